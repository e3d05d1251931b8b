import cv2
import numpy as np
import pytest

from mtm_audit.model.picture import Frame
from mtm_audit.tracking.cover import cover_of, split_colours
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol import MtmError


def disc(bgr, centre=(40.3, 30.7), background=128):
    image = np.full((80, 100, 3), background, np.uint8)
    place = tuple(round(value * 16) for value in centre)
    cv2.circle(image, place, 10 * 16, bgr, -1, cv2.LINE_AA, 4)
    return image


@pytest.mark.parametrize(
    ("colour", "bgr"),
    [
        ("hsv(100-130,80-255,60-255)", (255, 60, 20)),
        ("HSV(170-10, 80-255, 60-255)", (20, 20, 250)),
        ("hsv(170-10,80-255,60-255)", (60, 20, 250)),
    ],
)
def test_a_range_of_hsv_is_followed_like_a_colour(colour, bgr):
    frames = [Frame(number / 30, disc(bgr, (40 + number, 30.0))) for number in range(5)]
    (track,) = tracker(f"colour:{colour}").track(frames)
    truth = np.stack([40.0 + np.arange(5), np.full(5, 49.0)], axis=1)
    assert np.abs(track.positions - truth).max() < 0.2


@pytest.mark.parametrize("colour", ["hsv(100-130,80-255,60-255)", "blue"])
def test_other_hues_and_grays_are_not_covered(colour):
    cover = cover_of(colour)
    assert cover(disc((0, 0, 255))).max() < 0.05
    assert cover(disc((255, 255, 255))).max() < 0.05
    assert cover(disc((255, 0, 0))).max() == pytest.approx(1.0, abs=0.05)


def test_a_pixel_on_an_edge_counts_by_its_covered_part():
    large = np.full((400, 400, 3), 128, np.uint8)
    large[100:300, 104:300] = (255, 0, 0)
    image = cv2.resize(large, (50, 50), interpolation=cv2.INTER_AREA)
    assert cover_of("blue")(image).sum() == pytest.approx(200 * 196 / 64, rel=0.01)


def test_commas_inside_brackets_separate_no_colours():
    colours = split_colours("red, hsv(1-2,3-4,5-6),#00ffff")
    assert colours == ("red", "hsv(1-2,3-4,5-6)", "#00ffff")


@pytest.mark.parametrize(
    ("colour", "says"),
    [
        ("hsv(100-130)", "no range of colours"),
        ("hsv(100-200,0-255,0-255)", "no range of colours"),
        ("hsv(100-130,80-256,60-255)", "no range of colours"),
        ("hsv(100-130,80-60,60-255)", "is empty"),
        ("hsv(a-b,c-d,e-f)", "no range of colours"),
    ],
)
def test_a_range_that_is_none_is_refused(colour, says):
    with pytest.raises(MtmError, match=says):
        tracker(f"colour:{colour}")
