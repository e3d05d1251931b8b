"""Colours that drift with the light, and colours that are lost."""

import numpy as np
import pytest

from mtm_audit.model.picture import Frame
from mtm_audit.tracking import colour
from mtm_audit.tracking.registry import tracker

SIZE = (240, 320)
SECONDS, RATE_HZ = 12, 15


def pictures(gains=lambda time_s: (1.0, 1.0, 1.0), hidden=(), size=SIZE, count=SECONDS * RATE_HZ):
    """A red square on gray that goes to and fro, in light whose parts (blue, green, red) have the `gains`."""
    rng = np.random.default_rng(1)
    for number in range(count):
        image = np.full((*size, 3), 150.0)
        if number not in hidden:
            left, part = divmod(place(number), 1.0)
            cover = np.zeros(21)
            cover[:20] += 1.0 - part
            cover[1:] += part
            square = image[100:120, int(left) : int(left) + 21]
            square += cover[:, None] * (np.array([40.0, 40.0, 200.0]) - square)
        image = image * gains(number / RATE_HZ) + rng.normal(0, 1.5, image.shape)
        yield Frame(number / RATE_HZ, np.clip(image, 0, 255).astype(np.uint8))


def place(number):
    return 150 + 80 * np.sin(number / 9)


def off_px(track):
    """The rms distance from the square's middle, valid frames alone."""
    truth = np.array([place(number) + 9.5 for number in range(len(track.times_s))])
    return float(np.sqrt(np.mean((track.positions[track.valid, 0] - truth[track.valid]) ** 2)))


def warming(time_s):
    """White balance that drifts to the red."""
    part = time_s / SECONDS
    return (1.0 - 0.3 * part, 1.0, 1.0 + 0.2 * part)


def cooling(time_s):
    part = time_s / SECONDS
    return (1.0 + 0.5 * part, 1.0, 1.0 - 0.45 * part)


@pytest.mark.parametrize("gains", [warming, cooling])
def test_a_colour_is_followed_while_the_white_balance_drifts(gains):
    (track,) = tracker("colour:red").track(pictures(gains))
    assert track.valid.all()
    assert off_px(track) < 0.05


def test_without_learning_a_drift_loses_the_colour(monkeypatch):
    """What the others are measured by."""
    monkeypatch.setattr(colour, "LEARNT_EVERY", 10**9)
    (track,) = tracker("colour:red").track(pictures(cooling))
    assert track.valid.mean() < 0.8
    assert off_px(track) > 0.2


def test_steady_light_changes_nothing(monkeypatch):
    (adapting,) = tracker("colour:red").track(pictures())
    monkeypatch.setattr(colour, "LEARNT_EVERY", 10**9)
    (fixed,) = tracker("colour:red").track(pictures())
    assert np.abs(adapting.positions - fixed.positions).max() < 0.05


def test_a_colour_that_was_away_for_long_is_found_again():
    hidden = range(30, 110)
    (track,) = tracker("colour:red").track(pictures(hidden=hidden))
    assert track.valid[:30].all()
    assert not track.valid[30:110].any()
    assert track.valid[110 + colour.SELDOM_EVERY :].all()


def test_a_speck_is_found_in_the_end():
    """A patch that falls between the pixels looked at first."""
    frames = []
    for number in range(140):
        image = np.full((*SIZE, 3), 150, np.uint8)
        if number >= 10:
            image[61:63, 50:57] = (0, 0, 255)
        frames.append(Frame(number / 30, image))
    (track,) = tracker("colour:red").track(frames)
    assert track.valid[-10:].all()


@pytest.mark.slow
def test_looking_for_a_lost_colour_costs_little():
    """In calls, not in seconds: how many pixels are looked at in all."""
    looked = []
    cover_of = colour.DriftingCover.__call__

    def counted(self, image):
        looked[-1] += image.shape[0] * image.shape[1]
        return cover_of(self, image)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(colour.DriftingCover, "__call__", counted)
        for hidden in ((), range(10, 10**6)):
            looked.append(0)
            tracker("colour:red").track(pictures(hidden=hidden, size=(480, 640), count=300))
    seen, lost = looked
    assert lost < 3 * seen
