import cv2
import numpy as np
import pytest

from mtm_audit.model.picture import Frame
from mtm_audit.tracking.flow import FlowTracker
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol import MtmError

FRAMES = 60
TIMES_S = np.arange(FRAMES) / 50
CENTRES = np.stack([160 + 50 * np.sin(1.6 * TIMES_S), 120 + 30 * np.sin(2.2 * TIMES_S)], axis=1)
REGION = (132, 92, 188, 148)
SIDE = 64


def speckled(cells, size, low, high, seed):
    """A picture of soft random spots."""
    spots = np.random.default_rng(seed).integers(low, high, cells).astype(np.uint8)
    return cv2.resize(spots, size, interpolation=cv2.INTER_CUBIC)


def room(centres=CENTRES, turn_radps=0.5, covered=(), gone=()):
    """A patterned square that drives and turns on a faintly patterned floor; a gray sheet hides all but some floor."""
    floor, top = speckled((20, 28), (320, 240), 90, 150, 1), speckled((10, 10), (SIDE, SIDE), 0, 255, 2)
    noise = np.random.default_rng(3)
    for number, centre in enumerate(centres):
        pose = cv2.getRotationMatrix2D(((SIDE - 1) / 2,) * 2, np.degrees(turn_radps * number / 50), 1.0)
        pose[:, 2] += centre - (SIDE - 1) / 2
        own = cv2.warpAffine(np.ones((SIDE, SIDE), np.float32), pose, (320, 240)) * (number not in gone)
        image = floor * (1 - own) + cv2.warpAffine(top, pose, (320, 240)) * own
        if number in covered:
            image[:, 60:260] = 100
        image = np.clip(image + 2 * noise.standard_normal(image.shape), 0, 255).astype(np.uint8)
        yield Frame(number / 50, image)


def step_errors(track, centres=CENTRES):
    truth = np.stack([centres[:, 0], 239 - centres[:, 1]], axis=1)
    return np.diff(track.positions - truth, axis=0)


def rms(errors):
    return float(np.sqrt(np.nanmean(errors**2)))


@pytest.mark.parametrize("smooth", [True, False])
def test_an_unmarked_thing_is_followed_to_a_tenth_of_a_pixel(smooth):
    (track,) = FlowTracker(REGION, smooth=smooth).track(room())
    assert (track.name, track.unit) == ("flow", "px")
    assert track.valid.all()
    assert track.positions[0] == pytest.approx([159.5, 239 - 119.5])
    assert rms(step_errors(track)) < 0.1
    assert np.abs(np.cumsum(step_errors(track), axis=0)).max() < 2.0


def test_colour_pictures_will_do():
    frames = (Frame(frame.time_s, cv2.cvtColor(frame.image, cv2.COLOR_GRAY2BGR)) for frame in room())
    (track,) = tracker("flow:132,92,188,148").track(frames)
    assert rms(step_errors(track)) < 0.1


def test_what_is_covered_is_missing_and_found_where_it_comes_out():
    (track,) = FlowTracker(REGION).track(room(covered=range(20, 32)))
    truth = np.stack([CENTRES[:, 0], 239 - CENTRES[:, 1]], axis=1)
    assert not track.valid[20:32].any()
    assert track.valid[:20].all()
    assert track.valid[34:].all()
    assert np.abs(track.positions - truth)[track.valid].max() < 3.0


def test_what_drives_out_of_the_picture_is_missing_from_then_on():
    centres = np.stack([160 + 5.0 * np.arange(FRAMES), np.full(FRAMES, 120.0)], axis=1)
    (track,) = FlowTracker(REGION).track(room(centres, turn_radps=0.0))
    assert track.valid[centres[:, 0] < 280].all()
    assert not track.valid[centres[:, 0] > 370].any()
    assert np.nanmax(np.abs(step_errors(track, centres))) < 2.0


@pytest.mark.parametrize("name", ["flow", "flow:", "flow:1,2,3", "flow:50,50,40,90", "flow:a,b,c,d"])
def test_a_region_that_is_none_is_refused(name):
    with pytest.raises(MtmError, match="no region|none that could hold a robot"):
        tracker(name)


def test_a_region_beyond_the_picture_is_refused():
    with pytest.raises(MtmError, match="reaches beyond the picture, which is 320 x 240 pixels"):
        tracker("flow:300,200,400,300").track(room())


def test_a_region_of_nothing_is_refused():
    with pytest.raises(MtmError, match="of the first frame shows 0 corners"):
        tracker("flow:10,10,60,60").track(Frame(row / 30, np.full((96, 128), 128, np.uint8)) for row in range(3))


def test_what_vanishes_at_once_is_refused():
    blank = [Frame(1.0 + row / 30, np.full((240, 320), 128, np.uint8)) for row in range(3)]
    with pytest.raises(MtmError, match="is lost after the first of 4 frames"):
        FlowTracker(REGION).track([next(room()), *blank])


def test_no_frames_are_refused():
    with pytest.raises(MtmError, match="holds no frame"):
        FlowTracker(REGION).track([])


def test_a_picture_that_changes_its_size_is_refused():
    frames = [next(room()), Frame(1.0, np.zeros((96, 128), np.uint8))]
    with pytest.raises(MtmError, match="from 320 x 240 to 128 x 96 at 1.000 s"):
        FlowTracker(REGION).track(frames)
