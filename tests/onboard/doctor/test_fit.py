from dataclasses import replace

import numpy as np
import pytest

from mtm_onboard.doctor.fit import _relative_change, check_fit
from mtm_onboard.protocol import Channel, Key
from mtm_onboard.runtime.config import Robot, config_from_table
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.schemes import FAKE_SECRET, small_codebook, small_scheme

KEY = Key("fake-key", FAKE_SECRET, small_scheme())
CONFIG = config_from_table(
    {
        "robot": {"name": "r", "channel": "a"}, "transport": {"kind": "none"}, "source": {"kind": "stdin"},
        "limits": {"speed_mps": 1.0, "turn_rate_radps": 2.0},
    }
)  # fmt: skip


def found(key=KEY, channel="a", **limits):
    config = replace(CONFIG, robot=Robot("r", channel), limits=replace(CONFIG.limits, **limits))
    return check_fit(config, key)


def test_limits_far_above_the_noise_pass():
    assert found().status == "pass"
    assert found(channel="b").status == "pass"


def test_a_channel_that_the_key_lacks_names_those_it_has():
    assert found(channel="z").status == "fail"
    assert "a, b" in found(channel="z").text


def test_an_axis_that_no_body_velocity_has_is_a_failure():
    arm = replace(KEY, scheme=small_scheme(channels=(Channel("a", "arm", ("shoulder",), 1, 0.1),)))
    assert "shoulder" in found(arm).text
    assert found(arm).status == "fail"


def test_a_rover_cannot_play_a_channel_that_moves_it_sideways():
    rover = replace(CONFIG, transport_kind="mavlink", transport_options={"profile": "rover"})
    assert check_fit(rover, KEY).status == "fail"
    assert check_fit(replace(rover, robot=Robot("r", "b")), KEY).status == "pass"


@pytest.mark.parametrize(
    ("channel", "limits", "name", "status"),
    [
        ("a", {"noise_sigmas": 2.0}, "noise_sigmas", "warn"),
        ("a", {"noise_sigmas": 0.5}, "noise_sigmas", "fail"),
        ("a", {"speed_mps": 0.2}, "speed_mps", "warn"),
        ("a", {"speed_mps": 0.05}, "speed_mps", "fail"),
        ("b", {"turn_rate_radps": 0.3}, "turn_rate_radps", "warn"),
        ("a", {"acceleration_mps2": 10.0}, "acceleration_mps2", "warn"),
        ("a", {"acceleration_mps2": 1.0}, "acceleration_mps2", "fail"),
    ],
)
def test_a_limit_that_cuts_the_noise_is_named(channel, limits, name, status):
    finding = found(channel=channel, **limits)
    assert finding.status == status
    assert name in finding.text
    assert finding.figures["cut_part"] > 0.01


def test_limits_on_other_axes_than_the_channel_s_cut_nothing():
    assert found(channel="b", speed_mps=0.01).status == "pass"
    assert found(channel="a", turn_rate_radps=0.01).status == "pass"


def test_the_part_that_is_cut_is_the_part_that_the_guard_cuts():
    codebook = small_codebook(power="ensemble", message_ticks=30_000)
    plays = Modulator(codebook, "a", (0,))
    noise = 0.1 * np.array([plays.perturbation(tick) for tick in range(30_000)])
    cut = {
        "noise_sigmas": np.mean(np.abs(noise).max(axis=1) > 0.2),
        "speed_mps": np.mean(np.linalg.norm(noise, axis=1) > 0.2),
        "acceleration_mps2": np.mean(np.linalg.norm(np.diff(noise, axis=0), axis=1) > 10.0 / 50.0),
    }
    for name, bound in (("noise_sigmas", 2.0), ("speed_mps", 0.2), ("acceleration_mps2", 10.0)):
        assert found(**{name: bound}).figures["cut_part"] == pytest.approx(cut[name], abs=0.015)


@pytest.mark.parametrize("spectrum", [None, ((2.0, 0.0), (20.0, -15.0))], ids=["flat", "slope"])
def test_the_change_a_tick_is_that_of_noise_in_the_band(spectrum):
    plays = Modulator(small_codebook(message_ticks=6000, spectrum=spectrum), "a", (0,))
    noise = np.array([plays.perturbation(tick) for tick in range(6000)])
    scheme = small_scheme(spectrum=spectrum)
    change = _relative_change(scheme, scheme.channels[0])
    assert change == pytest.approx(np.diff(noise, axis=0).std() / noise.std(), rel=0.03)
