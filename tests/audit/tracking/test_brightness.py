import cv2
import numpy as np
import pytest

from mtm_audit.model.picture import Frame
from mtm_audit.tracking.brightness import BrightnessTracker
from mtm_audit.tracking.kalman import kalman_smoothed
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol import MtmError

PURPLE_BGR = (230, 102, 128)
REGION = "brightness:20,10,280,150"
FRAMES = 60
TIMES_S = np.arange(FRAMES) / 50
CENTRES = np.stack([150 + 60 * np.sin(2 * TIMES_S), 80 + 30 * np.cos(3 * TIMES_S)], axis=1)


def night(count=FRAMES, centres=CENTRES, hidden=()):
    """A purple hexagon in a black sky above white ground with a mast; `centres` in pixels, y down."""
    turn = 0.3 + np.pi / 3 * np.arange(6)
    hexagon = 12 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    for number in range(count):
        image = np.zeros((200, 300, 3), np.uint8)
        image[160:] = 255
        cv2.line(image, (200, 160), (200, 130), (255, 255, 255), 1)
        if number not in hidden:
            corners = np.round((hexagon + centres[number]) * 16).astype(np.int32)
            cv2.fillPoly(image, [corners], PURPLE_BGR, cv2.LINE_AA, 4)
        yield Frame(number / 50, image)


def truth(centres=CENTRES):
    return np.stack([centres[:, 0], 199 - centres[:, 1]], axis=1)


def rms(errors):
    return float(np.sqrt(np.mean(errors**2)))


def test_a_bright_body_is_tracked_to_a_tenth_of_a_pixel():
    (track,) = tracker(REGION).track(night())
    assert (track.name, track.unit, track.axes) == ("bright", "px", ("x", "y"))
    assert track.valid.all()
    assert rms(track.positions - truth()) < 0.1


def test_gray_pictures_show_the_same_as_coloured_ones():
    gray = (Frame(frame.time_s, cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY)) for frame in night())
    (one,), (other,) = tracker(REGION).track(gray), tracker(REGION).track(night())
    assert np.array_equal(one.positions, other.positions)


def test_ground_that_reaches_the_edge_is_no_body():
    (track,) = tracker("brightness").track(night())
    assert rms(track.positions - truth()) < 0.1


def test_the_papers_filter_may_be_left_out():
    (raw,) = BrightnessTracker((20, 10, 280, 150), smooth=False).track(night())
    (filtered,) = BrightnessTracker((20, 10, 280, 150)).track(night())
    assert np.array_equal(kalman_smoothed(raw).positions, filtered.positions)
    assert not np.array_equal(raw.positions, filtered.positions)


def test_a_body_that_is_gone_for_a_while_is_missing_meanwhile():
    (track,) = tracker(REGION).track(night(hidden=range(20, 30)))
    assert np.array_equal(np.flatnonzero(~track.valid), np.arange(20, 30))
    assert np.isnan(track.positions[20:30]).all()
    assert rms((track.positions - truth())[track.valid]) < 0.1


def test_a_body_that_the_regions_edge_cuts_is_missing():
    centres = np.stack([np.linspace(150, 330, FRAMES), np.full(FRAMES, 80.0)], axis=1)
    (track,) = tracker(REGION).track(night(centres=centres))
    assert track.valid[centres[:, 0] < 265].all()
    assert not track.valid[centres[:, 0] > 270].any()
    assert rms((track.positions - truth(centres))[track.valid]) < 0.1


def test_searching_nearby_finds_what_searching_everywhere_finds(monkeypatch):
    (nearby,) = tracker(REGION).track(night())
    monkeypatch.setattr("mtm_audit.tracking.brightness.FULL_SEARCH_EVERY", 1)
    (everywhere,) = tracker(REGION).track(night())
    assert np.allclose(nearby.positions, everywhere.positions)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("brightness:a,b,c,d", "no region"),
        ("brightness:1,2,3", "describes no bright thing"),
        ("brightness:1,2,100,100,50,7", "describes no bright thing"),
        ("brightness:100,100,50,50", "none that could hold a robot"),
        ("brightness:-5,0,50,50", "none that could hold a robot"),
        ("brightness:300", "between 0 and 255"),
        ("brightness:nan", "between 0 and 255"),
    ],
)
def test_a_bad_region_or_threshold_is_refused(name, says):
    with pytest.raises(MtmError, match=says):
        tracker(name)


def test_a_region_beyond_the_picture_is_refused():
    with pytest.raises(MtmError, match="reaches beyond the picture, which is 300 x 200 pixels"):
        tracker("brightness:20,10,320,150").track(night())


def test_a_dark_video_is_refused():
    with pytest.raises(MtmError, match="nothing brighter than 60 found whole inside the region in 60 frames"):
        tracker(REGION).track(night(hidden=range(FRAMES)))


def test_a_picture_that_changes_its_size_is_refused():
    frames = [Frame(0.0, np.zeros((96, 128), np.uint8)), Frame(0.1, np.zeros((128, 96), np.uint8))]
    with pytest.raises(MtmError, match="from 128 x 96 to 96 x 128 at 0.100 s"):
        tracker("brightness").track(frames)
