"""The spectrum that a plan proposes for robots that a profile describes."""

from dataclasses import replace

import numpy as np
import pytest

from mtm_audit.detectors.matched.axis_response import AxisResponse
from mtm_audit.detectors.matched.plants import FINE
from mtm_audit.detectors.matched.profile import PlantProfile, load_profile, profile_text, save_profile
from mtm_audit.planning.shaping import shaped, shaping_for, shaping_text, signal_to_motion
from mtm_onboard.protocol import Channel, MtmError
from mtm_onboard.protocol.spectrum import tone_powers
from tests.audit.moving_robot import scheme_of

WEIGHTS = np.full(len(FINE.taps), 1.0 / len(FINE.taps))
HZ = np.geomspace(0.2, 10.0, 30)
# A first-order lag with its corner at 1 Hz before white motion; and a busy axis that follows as far as the band goes.
SLOW = AxisResponse("vx", tuple((hz, 1.0 / np.sqrt(1.0 + hz**2), 4e-4) for hz in HZ.tolist()))
BUSY = AxisResponse("wz", tuple((hz, 1.0, 4e-3 / hz) for hz in HZ.tolist()))
SCHEME = replace(scheme_of(symbols=(1,), ticks=400), channels=(Channel("robot0", "robot0", ("vx",), 1, 0.05),))


def profile(*axes):
    return PlantProfile(WEIGHTS, axes)


def test_a_robot_that_is_slow_gets_its_noise_at_low_frequencies():
    shaping = shaping_for(SCHEME, profile(SLOW))
    levels_db = [level_db for _, level_db in shaping.spectrum]
    assert levels_db == sorted(levels_db, reverse=True)
    assert levels_db[0] == 0.0
    assert levels_db[-1] < -6.0
    assert shaping.flat_bps < shaping.proposed_bps <= shaping.best_bps
    assert shaping.proposed_bps > 0.98 * shaping.best_bps


def test_axes_share_a_spectrum_and_count_with_their_own_noise():
    both = replace(SCHEME, channels=(Channel("robot0", "robot0", ("vx", "wz"), 1, 0.05),))
    frequencies_hz, ratios = signal_to_motion(both, profile(SLOW, BUSY))
    assert ratios.shape == (2, len(frequencies_hz))
    assert ratios[0] == pytest.approx(0.05**2 / 4.5 / (1.0 + frequencies_hz**2) / 4e-4, rel=0.01)
    assert ratios[1] == pytest.approx(0.05**2 / 4.5 * frequencies_hz / 4e-3, rel=0.01)
    louder = replace(both, channels=(replace(both.channels[0], sigma=0.1),))
    assert signal_to_motion(louder, profile(SLOW, BUSY))[1] == pytest.approx(4.0 * ratios)


def test_where_nothing_is_carried_the_sentence_says_so():
    quiet = replace(SCHEME, channels=(replace(SCHEME.channels[0], sigma=0.01),))
    shaping = shaping_for(quiet, profile(SLOW))
    assert shaping.carrying_hz[0] == 0.5
    assert shaping.carrying_hz[1] < 3.0
    assert f"it carries from 0.5 to {shaping.carrying_hz[1]:.2g} Hz" in shaping_text(shaping)


def test_the_scheme_has_the_spectrum_and_a_name_that_says_so():
    shaping = shaping_for(SCHEME, profile(SLOW))
    scheme = shaped(SCHEME, shaping)
    assert (scheme.name, scheme.spectrum) == ("test-filled", shaping.spectrum)
    assert scheme.fingerprint != SCHEME.fingerprint
    assert tone_powers(shaping.spectrum, np.linspace(0.5, 5.0, 9)).mean() == pytest.approx(1.0)


def test_an_axis_that_was_not_measured_gets_one_sentence():
    with pytest.raises(
        MtmError, match="does not say how the axis vx follows and moves; make one with mtm-hil identify"
    ):
        shaping_for(SCHEME, profile(BUSY))


def test_a_profile_file_keeps_its_axes(tmp_path):
    save_profile(profile(SLOW, BUSY), tmp_path / "rover.toml")
    again = load_profile(tmp_path / "rover.toml").axes
    assert [axis.name for axis in again] == ["vx", "wz"]
    for before, after in zip((SLOW, BUSY), again, strict=True):
        assert np.array(after.rows) == pytest.approx(np.array(before.rows), rel=1e-3)
    assert "axes" not in profile_text(profile())


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("3", "axis 'vx' must list two or more rows"),
        ("[]", "axis 'vx' must list two or more rows"),
        ("[[1.0, 1.0, 1.0]]", "axis 'vx' must list two or more rows"),
        ("[[1.0, 1.0], [2.0, 1.0]]", "rows of three numbers above zero"),
        ("[[1.0, 1.0, 0.0], [2.0, 1.0, 1.0]]", "rows of three numbers above zero"),
        ("[[1.0, nan, 1.0], [2.0, 1.0, 1.0]]", "rows of three numbers above zero"),
        ("[[1.0, true, 1.0], [2.0, 1.0, 1.0]]", "rows of three numbers above zero"),
        ("[[2.0, 1.0, 1.0], [1.0, 1.0, 1.0]]", "frequencies of axis 'vx' must rise"),
    ],
)
def test_axes_that_are_none_get_one_sentence(tmp_path, rows, says):
    (tmp_path / "rover.toml").write_text(f"{profile_text(profile())}[axes]\nvx = {rows}\n")
    with pytest.raises(MtmError, match=says):
        load_profile(tmp_path / "rover.toml")
    (tmp_path / "rover.toml").write_text(f"axes = 3\n{profile_text(profile())}")
    with pytest.raises(MtmError, match="axes must be a table"):
        load_profile(tmp_path / "rover.toml")
