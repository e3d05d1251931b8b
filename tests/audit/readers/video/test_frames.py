import numpy as np
import pytest

from hil.sensors.video import write_video
from mtm_audit.ingest.load import is_video, load_tracks
from mtm_audit.model.picture import Frame
from mtm_audit.readers.video import inspect_video, read_frames
from mtm_onboard.protocol import MtmError

RNG = np.random.default_rng(1)
PICTURE = np.kron(RNG.integers(0, 255, (6, 8, 3)), np.ones((16, 16, 1))).astype(np.uint8)


def moving_pictures(times_s):
    return [Frame(float(time_s), np.roll(PICTURE, 3 * row, axis=1)) for row, time_s in enumerate(times_s)]


@pytest.fixture
def video(tmp_path):
    path = tmp_path / "film.mp4"
    write_video(moving_pictures(np.arange(90) / 30), path)
    return path


def test_irregular_and_dropped_frames_keep_their_times(tmp_path):
    times_s = 0.0123 + np.arange(60) / 30 + RNG.uniform(-0.01, 0.01, 60)
    times_s = np.delete(times_s, [5, 6, 30])
    assert write_video(moving_pictures(times_s), tmp_path / "film.mp4") == 57
    back = [frame.time_s for frame in read_frames(tmp_path / "film.mp4")]
    assert back == pytest.approx(times_s, abs=1 / 90_000)


def test_a_file_states_its_size_length_and_count(video):
    header = inspect_video(video)
    assert (header.width_px, header.height_px, header.frame_count) == (128, 96, 90)
    assert header.duration_s == pytest.approx(3.0, abs=0.05)


@pytest.mark.parametrize("pixels", ["gray", "bgr"])
def test_pictures_come_back_nearly_as_they_were(video, pixels):
    frame = next(read_frames(video, pixels))
    expected = PICTURE if pixels == "bgr" else PICTURE @ [0.114, 0.587, 0.299]
    assert frame.image.shape == expected.shape
    assert frame.size == (128, 96)
    span = 1.0 if pixels == "bgr" else 219 / 255  # the luma plane runs from 16 to 235
    offset = 0 if pixels == "bgr" else 16
    assert np.abs(frame.image - (offset + span * expected)).mean() < 6


def test_reading_is_lazy(video):
    frames = read_frames(video)
    next(frames)
    frames.close()


def test_a_copy_that_broke_off_is_read_up_to_the_break(video):
    content = video.read_bytes()
    video.write_bytes(content[: len(content) * 2 // 3])
    warnings = []
    frames = list(read_frames(video, warn=warnings.append))
    assert 10 < len(frames) < 90
    assert len(warnings) == 1
    assert f"only the {len(frames)} frames" in warnings[0]


def test_damage_in_the_middle_ends_the_reading_there(video):
    content = bytearray(video.read_bytes())
    middle = len(content) * 2 // 3
    content[middle : middle + 400] = b"\xff" * 400
    video.write_bytes(content)
    warnings = []
    frames = list(read_frames(video, warn=warnings.append))
    assert 10 < len(frames) < 90
    assert "damaged after" in warnings[0]


def test_a_whole_file_gives_no_warning(video):
    warnings = []
    assert len(list(read_frames(video, warn=warnings.append))) == 90
    assert not warnings


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"", "is empty"), (b"no film at all " * 99, "not a video"), (b"\0\1\2" * 999, "not a video")],
)
def test_what_is_no_video_is_refused_without_a_word_on_stderr(tmp_path, capfd, content, says):
    path = tmp_path / "film.mp4"
    path.write_bytes(content)
    for read in (inspect_video, lambda path: list(read_frames(path)), load_tracks):
        with pytest.raises(MtmError, match=says):
            read(path)
    assert capfd.readouterr() == ("", "")


def test_a_video_whose_beginning_is_all_there_is_is_refused(video, capfd):
    video.write_bytes(video.read_bytes()[:300])
    with pytest.raises(MtmError, match="not a video|no video stream|no picture"):
        list(read_frames(video))
    assert capfd.readouterr() == ("", "")


def test_sound_without_pictures_is_refused(tmp_path):
    import wave

    with wave.open(str(tmp_path / "sound.wav"), "wb") as file:
        file.setparams((1, 2, 8000, 0, "NONE", ""))
        file.writeframes(b"\0\0" * 8000)
    with pytest.raises(MtmError, match="no video stream"):
        load_tracks(tmp_path / "sound.wav")


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    with pytest.raises(MtmError, match="check the name"):
        load_tracks(tmp_path / "film.mp4")
    with pytest.raises(MtmError, match="folder"):
        load_tracks(tmp_path)


def test_text_is_motion_capture_whatever_its_suffix(tmp_path, video):
    path = tmp_path / "robot3.log"
    path.write_text("0 1 2 0 0 0 0 1\n1 1 2 0 0 0 0 1\n")
    assert [track.name for track in load_tracks(path)] == ["robot3"]
    assert is_video(video.rename(tmp_path / "film.unknown"))


def test_a_recording_that_fails_leaves_the_old_file(video):
    before = video.read_bytes()
    with pytest.raises(MtmError, match="does not come after"):
        write_video(moving_pictures([0.0, 0.1, 0.1]), video)
    with pytest.raises(MtmError, match="no frame"):
        write_video([], video)
    with pytest.raises(MtmError, match="even numbers"):
        write_video([Frame(0.0, PICTURE[:95])], video)
    assert video.read_bytes() == before
    assert list(video.parent.iterdir()) == [video]
