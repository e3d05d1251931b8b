"""Films that are being shot: served on loopback by the library that reads them, or written while they are read."""

import io
import socket
import threading
from contextlib import suppress
from dataclasses import replace

import av
import cv2
import numpy as np
import pytest

from hil.sensors.camera import film
from hil.sensors.scene import Scene
from hil.sensors.video import write_video
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.ingest.load import load_tracks
from mtm_audit.live.events import Notice
from mtm_audit.live.films import Address, FilmSource
from mtm_audit.live.judges import JudgeHere
from mtm_audit.live.record import FilmRecord
from mtm_audit.live.sources import source_of
from mtm_audit.live.watching import Film, Watch
from mtm_audit.model.picture import Frame
from mtm_audit.readers.video import read_frames
from mtm_audit.tracking.following import following
from mtm_onboard.protocol import MtmError
from tests.audit.filmed_robots import CAMERA, KEY, MESSAGE, trajectories
from tests.audit.live.watched import Told

SECONDS = 6.0


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    path = tmp_path_factory.mktemp("film") / "film.mp4"
    frames = film(replace(CAMERA), Scene(), trajectories(seconds=SECONDS), np.random.default_rng(1))
    write_video(frames, path, CAMERA.rate_hz, 12)
    return path


def copied(path, target, form, most=None):
    """The film's first packets as they are, in another container."""
    with av.open(str(path)) as source, av.open(target, "w", format=form) as output:
        stream = source.streams.video[0]
        copy = output.add_stream_from_template(stream)
        for number, packet in enumerate(source.demux(stream)):
            if packet.dts is not None and (most is None or number < most):
                packet.stream = copy
                output.mux(packet)


@pytest.fixture(scope="module")
def short(filmed):
    """Its first two seconds."""
    path = filmed.with_name("short.mp4")
    copied(filmed, str(path), "mp4", 60)
    return path


def as_stream(path):
    """The film as MPEG-TS, as cameras send it."""
    written = io.BytesIO()
    copied(path, written, "mpegts")
    return written.getvalue()


@pytest.fixture
def served(short):
    """Send the film to so many who connect, one after the other; gives the address."""
    data, threads = as_stream(short), []

    def serve(listener, times):
        with listener:
            for _ in range(times):
                connection, _ = listener.accept()
                with connection, suppress(OSError):
                    connection.sendall(data)

    def begin(times=1):
        listener = socket.create_server(("127.0.0.1", 0))
        thread = threading.Thread(target=serve, args=(listener, times), daemon=True)
        thread.start()
        threads.append(thread)
        url = f"tcp://127.0.0.1:{listener.getsockname()[1]}"
        return Address(url, url)

    yield begin
    for thread in threads:
        thread.join(1.0)


class Wall:
    """A clock that goes as fast as it is told."""

    def __init__(self):
        self.now_s, self.slept = 0.0, []

    def __call__(self):
        self.now_s += 1.0 / 30.0
        return self.now_s

    def sleep(self, pause_s):
        self.now_s += pause_s
        self.slept.append(pause_s)


def test_a_stream_shows_the_film_s_pictures_at_its_times(short, served):
    wall = Wall()
    frames = []
    for event in FilmSource(served(), "gray", clock=wall, sleep=wall.sleep).events():
        if isinstance(event, Notice):
            break
        frames.append(event)
    wanted = list(read_frames(short))
    assert len(frames) == len(wanted)
    shifts_s = [frame.time_s - one.time_s for frame, one in zip(frames, wanted, strict=True)]
    assert np.ptp(shifts_s) < 1e-3
    assert np.array_equal(frames[40].image, wanted[40].image)


def test_a_dropped_stream_is_told_once_and_comes_back(served):
    wall = Wall()
    events, found = FilmSource(served(times=2), "gray", clock=wall, sleep=wall.sleep).events(), []
    for event in events:
        found.append(event)
        if isinstance(event, Notice) and "dropped" not in event.sentence:
            found.append(next(events))
            break
    notices = [event.sentence for event in found if isinstance(event, Notice)]
    times_s = [event.time_s for event in found if isinstance(event, Frame)]
    assert len(notices) == 2
    assert "has dropped" in notices[0]
    # The gap is unseen, and as long as it was on the wall.
    assert times_s == sorted(times_s)
    assert times_s[-1] - times_s[-2] > 0.4
    assert wall.slept[0] == 0.5


def test_pauses_between_tries_double_up_to_half_a_minute(served):
    wall = Wall()

    def give_up(pause_s):
        wall.slept.append(pause_s)
        if len(wall.slept) >= 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        list(FilmSource(served(), "gray", clock=wall, sleep=give_up).events())
    assert wall.slept == [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0]


def test_nobody_there_is_one_sentence():
    with pytest.raises(MtmError, match=r"cannot watch tcp://127\.0\.0\.1:9"):
        next(FilmSource(Address("tcp://127.0.0.1:9", "tcp://127.0.0.1:9"), "gray").events())


def test_a_stream_may_not_name_files_of_this_machine(tmp_path):
    (tmp_path / "list.ffconcat").write_text("ffconcat version 1.0\nfile film.mp4\n")
    url = f"file://{tmp_path}/list.ffconcat"
    with pytest.raises(MtmError):
        next(FilmSource(Address(url, "it"), "gray").events())


def test_a_watched_film_decodes_and_what_was_kept_does_too(filmed, tmp_path):
    told = Told()
    with FilmRecord(tmp_path) as record:
        watch = Watch(KEY.scheme, Film(following("aruco")), JudgeHere(KEY, DecodeSettings()), told, waits=True)
        watch.run(FilmSource(filmed, "gray", record, patience_s=0.1).events())
    assert watch.is_decided
    assert watch.best.decoding.message == MESSAGE
    whole, kept = (load_tracks(path)[0] for path in (filmed, *record.files))
    # The last pictures came in another order than they are shown, and some not any more.
    count = len(kept.times_s) - 4
    assert count > 60
    assert np.allclose(kept.positions[:count], whole.positions[:count], equal_nan=True)
    assert np.ptp(kept.times_s[:count] - whole.times_s[:count]) < 2e-3


def test_what_comes_after_the_end_is_not_kept(short, tmp_path):
    record = FilmRecord(tmp_path)
    for count, _ in enumerate(FilmSource(short, "gray", record, patience_s=0.0).events()):
        if count == 10:
            record.close()
    assert len(record.files) == 1
    assert 0 < len(list(read_frames(record.files[0]))) < 30


def test_a_device_that_is_no_camera_is_one_sentence():
    with pytest.raises(MtmError, match="cannot watch /dev/null"):
        next(source_of("/dev/null").events("gray"))


def test_a_film_that_grows_is_read_to_its_end(short, tmp_path):
    copied(short, str(tmp_path / "whole.mkv"), "matroska")
    data, grown = (tmp_path / "whole.mkv").read_bytes(), tmp_path / "grown.mkv"
    grown.write_bytes(data[: len(data) // 3])

    def grow(pause_s):
        written = grown.stat().st_size
        with grown.open("ab") as file:
            file.write(data[written : written + 60_000])

    frames = [event for event in FilmSource(grown, "gray", patience_s=0.3, sleep=grow).events()
              if isinstance(event, Frame)]  # fmt: skip
    assert len(frames) == len(list(read_frames(short)))


def test_pictures_over_http_are_made_when_they_arrive(tmp_path):
    """Each comes by itself and without a time; the library would say 25 a second."""
    _, picture = cv2.imencode(".jpg", np.full((48, 64), 90, np.uint8))
    listener = socket.create_server(("127.0.0.1", 0))

    def serve():
        with listener:
            connection, _ = listener.accept()
            with connection, suppress(OSError):
                connection.recv(65536)
                connection.sendall(b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=x\r\n\r\n")
                for _ in range(20):
                    head = b"--x\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(picture)
                    connection.sendall(head + picture.tobytes() + b"\r\n")

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    url, wall = f"http://127.0.0.1:{listener.getsockname()[1]}/", Wall()
    found = []
    with FilmRecord(tmp_path) as record:
        for event in FilmSource(Address(url, url), "gray", record, clock=wall, sleep=wall.sleep).events():
            if isinstance(event, Notice) and "has dropped" in event.sentence:
                break
            found.append(event)
    thread.join(5.0)
    notice, *frames = found
    assert "states no times" in notice.sentence
    # This clock goes on by a thirtieth of a second for each.
    steps_s = np.diff([frame.time_s for frame in frames])
    assert np.allclose(steps_s, 1.0 / 30.0)
    assert len(frames) >= 18
    kept = [frame.time_s for frame in read_frames(record.files[0])]
    assert np.allclose(np.diff(kept), 1.0 / 30.0, atol=2e-3)
