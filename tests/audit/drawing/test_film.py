import av
import numpy as np
import pytest

from mtm_audit.drawing.film import film_writer, write_picture
from mtm_audit.model.picture import Frame
from mtm_audit.readers.video import read_frames
from mtm_onboard.protocol import MtmError


def colours(count, size=(64, 48)):
    return [np.full((size[1], size[0], 3), 20 + 40 * number, np.uint8) for number in range(count)]


def written(path, times_s, size=(64, 48)):
    with film_writer(path, "mtm-audit test") as write:
        for time_s, image in zip(times_s, colours(len(times_s), size), strict=True):
            write(Frame(time_s, image))
    return path


@pytest.mark.parametrize(
    "times_s", [(0.0, 0.04, 0.08), (0.5, 0.51, 1.7, 1.9), (50_000.0, 50_000.033, 50_000.066)], ids=str
)
def test_each_picture_keeps_its_own_time(tmp_path, times_s):
    path = written(tmp_path / "a.mp4", times_s)
    assert [frame.time_s for frame in read_frames(path)] == pytest.approx(list(times_s), abs=2e-5)


def test_it_is_h264_that_any_player_shows(tmp_path):
    with av.open(str(written(tmp_path / "a.mp4", (0.0, 0.1)))) as container:
        context = container.streams.video[0].codec_context
        assert (context.name, context.pix_fmt) == ("h264", "yuv420p")


@pytest.mark.parametrize("size", [(63, 47), (64, 47), (63, 48)])
def test_odd_sizes_are_made_even(tmp_path, size):
    frames = list(read_frames(written(tmp_path / "a.mp4", (0.0, 0.1), size), "bgr"))
    assert frames[0].size == (64, 48)
    assert np.abs(frames[1].image.astype(int) - 60).max() < 6


def broken_off(path):
    with film_writer(path, "mtm-audit test", force=True) as write:
        write(Frame(0.0, colours(1)[0]))
        raise RuntimeError


def test_a_film_that_fails_leaves_nothing(tmp_path):
    (tmp_path / "a.mp4").write_text("what was there before")
    with pytest.raises(RuntimeError):
        broken_off(tmp_path / "a.mp4")
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]
    assert (tmp_path / "a.mp4").read_text() == "what was there before"


def test_no_picture_and_times_that_run_back_are_refused(tmp_path):
    with pytest.raises(MtmError, match="no frame"), film_writer(tmp_path / "a.mp4", "mtm-audit test"):
        pass
    with pytest.raises(MtmError, match="does not come after"):
        written(tmp_path / "a.mp4", (0.1, 0.1))
    assert list(tmp_path.iterdir()) == []


def test_a_picture_is_written_whole(tmp_path):
    write_picture(colours(1)[0], tmp_path / "a.png", "mtm-audit test")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG\r\n")
    with pytest.raises(MtmError, match="cannot write"):
        write_picture(colours(1)[0], tmp_path / "nowhere" / "a.png", "mtm-audit test")


@pytest.mark.parametrize("name", ["a.mp4", "a.png"])
def test_only_what_the_same_command_drew_is_replaced(tmp_path, name):
    def drawn(command, force=False):
        if name == "a.png":
            write_picture(colours(1)[0], tmp_path / name, command, force=force)
            return
        with film_writer(tmp_path / name, command, force=force) as write:
            write(Frame(0.0, colours(1)[0]))

    drawn("mtm-audit test")
    drawn("mtm-audit test")
    before = (tmp_path / name).read_bytes()
    with pytest.raises(MtmError, match="was not made by mtm-audit other"):
        drawn("mtm-audit other")
    assert (tmp_path / name).read_bytes() == before
    drawn("mtm-audit other", force=True)
    assert (tmp_path / name).read_bytes() != before
