"""Damaged films end in a sentence or in the pictures before the damage, and in nothing else."""

from contextlib import suppress

import av
import cv2
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mtm_audit.ingest.load import load_tracks
from mtm_audit.readers.video import inspect_video, read_frames
from mtm_audit.readers.video.compression import read_compression
from mtm_onboard.protocol import MtmError
from tests.audit.readers.video.films import KINDS, pictures, turn, write_film

READERS = (inspect_video, lambda film: list(read_frames(film, "bgr")), read_compression)
DAMAGE = st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.binary(min_size=0, max_size=6), st.integers(0, 40))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The content of a whole film of each kind."""
    folder = tmp_path_factory.mktemp("whole")
    films = {name: write_film(folder / name, pictures(12), encoding) for name, encoding in KINDS.items()}
    turn(films["film.mp4"], 90)
    return {name: film.read_bytes() for name, film in films.items()}


@pytest.mark.parametrize("name", KINDS)
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(damage=st.lists(DAMAGE, min_size=1, max_size=8))
def test_a_damaged_film_is_read_or_refused(whole, tmp_path, name, damage):
    content = bytearray(whole[name])
    for place, written, lost in damage:
        start = int(place * len(content))
        content[start : start + len(written) + lost] = written
    film = tmp_path / name
    film.write_bytes(content)
    for read in READERS:
        with suppress(MtmError):
            read(film)


def test_a_codec_without_a_decoder_is_refused(whole, tmp_path):
    film = tmp_path / "film.mp4"
    film.write_bytes(whole["film.mp4"].replace(b"avc1", b"zzz1"))
    with pytest.raises(MtmError, match=r"cannot be read here|no picture|not a video"):
        list(read_frames(film))


RAISED = [
    *{kind for kind in vars(av.error).values() if isinstance(kind, type) and issubclass(kind, av.FFmpegError)},
    cv2.error, EOFError, MemoryError, OverflowError, RuntimeError, ZeroDivisionError, PermissionError,
]  # fmt: skip


def raised(kind):
    return kind(1, "it cannot be\ndone") if issubclass(kind, OSError | av.FFmpegError) else kind("it cannot be\ndone")


@pytest.mark.parametrize("kind", sorted(RAISED, key=lambda kind: (kind.__module__, kind.__name__)))
@pytest.mark.parametrize("place", ["av.open", "mtm_audit.readers.video.opened.film_of"])
def test_whatever_a_library_raises_is_one_sentence(whole, tmp_path, monkeypatch, kind, place):
    film = tmp_path / "film.mp4"
    film.write_bytes(whole["film.mp4"])

    def fail(*_):
        raise raised(kind)

    monkeypatch.setattr(place, fail)
    for read in READERS:
        with pytest.raises(MtmError, match="video that can") as refusal:
            read(film)
        assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("kind", [cv2.error, MemoryError, av.error.EOFError])
def test_a_picture_that_cannot_be_converted_is_told(whole, tmp_path, monkeypatch, kind):
    film = tmp_path / "film.mp4"
    film.write_bytes(whole["film.mp4"])

    def fail(*_):
        raise raised(kind)

    monkeypatch.setattr("mtm_audit.readers.video.frames.image_of", fail)
    with pytest.raises(MtmError, match="video that cannot be read"):
        list(read_frames(film))


@pytest.mark.parametrize("suffix", ["mp4", "mov", "mkv", "webm", "avi", "ts", "h264", "gif", "bin", ""])
@pytest.mark.parametrize("content", [b"\0", b"\0\0", b"\0" * 5000, b"\xff"], ids=["one", "two", "many", "high"])
def test_a_file_of_nothing_but_zeros_is_refused(tmp_path, suffix, content):
    film = tmp_path / f"film.{suffix}"
    film.write_bytes(content)
    with suppress(MtmError):  # a bare stream of nothing says nothing of itself
        inspect_video(film)
        read_compression(film)
    for read in (read_frames, load_tracks):
        with pytest.raises(MtmError):
            list(read(film))


def test_one_zero_is_not_taken_for_text(tmp_path):
    film = tmp_path / "film"
    film.write_bytes(b"\0")
    with pytest.raises(MtmError, match="not a video"):
        load_tracks(film)
