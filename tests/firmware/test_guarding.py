"""Deadman, stop and limits of the C core, each at its boundary."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.firmware.image import MAX_Q20, ONE
from tests.firmware.shim_player import ShimPlayer
from tests.firmware.test_playing import WIDE, message_image

BASE = (ONE, -ONE, ONE // 2)


def playing(**settings):
    player = ShimPlayer(50_000, WIDE, **settings)
    player.offer(message_image())
    return player


def test_nothing_moves_before_the_first_command():
    player = playing()
    assert [player.tick(20_000 * tick, None) for tick in range(5)] == [[0, 0, 0]] * 5
    assert player.counts.deadman_trips == 0


def test_noise_ends_at_100_ms_and_motion_at_250_ms():
    player = playing()
    player.tick(0, BASE)
    assert player.tick(99_999, None) != list(BASE)
    assert player.tick(100_000, None) == list(BASE)
    assert player.tick(175_000, None) == [value // 2 for value in BASE]
    assert 0 < player.tick(249_000, None)[0] < ONE // 100
    assert player.tick(250_000, None) == [0, 0, 0]
    assert player.tick(2**31 - 1, None) == [0, 0, 0]
    assert player.counts.deadman_trips == 1


@given(hold_ms=st.integers(1, 9_999), span_ms=st.integers(1, 9_999), age_us=st.integers(0, 12_000_000))
def test_a_stale_command_only_fades_and_carries_no_noise(hold_ms, span_ms, age_us):
    zero_ms = min(hold_ms + span_ms, 10_000)
    player = playing(hold_ms=hold_ms, zero_ms=zero_ms)
    player.tick(0, BASE)
    out = player.tick(age_us, None)
    if age_us >= zero_ms * 1000:
        assert out == [0, 0, 0]
    elif age_us >= hold_ms * 1000:
        part = (zero_ms * 1000 - age_us) / (zero_ms - hold_ms) / 1000
        assert out == pytest.approx([value * part for value in BASE], abs=ONE / 256 + 1)


def test_a_command_after_silence_brings_the_noise_back():
    steady, interrupted = playing(), playing()
    for tick in range(30):
        expected = steady.tick(20_000 * tick, BASE)
        heard = interrupted.tick(20_000 * tick, None if 3 <= tick < 20 else BASE)
        if tick >= 20:
            assert heard == expected


def test_stop_is_latched_and_then_waits_for_a_new_command():
    player = playing()
    player.tick(0, BASE)
    player.lib.mtm_shim_stop(player.shim)
    assert [player.tick(20_000 * tick, BASE) for tick in range(1, 4)] == [[0, 0, 0]] * 3
    player.lib.mtm_shim_release(player.shim)
    assert player.tick(80_000, None) == [0, 0, 0]
    steady = playing()
    expected = [steady.tick(20_000 * tick, BASE) for tick in range(6)][5]
    assert player.tick(100_000, BASE) == expected


def test_releasing_what_was_not_stopped_changes_nothing():
    player = playing()
    player.tick(0, BASE)
    player.lib.mtm_shim_release(player.shim)
    assert player.tick(20_000, None) != [0, 0, 0]


@pytest.mark.parametrize("axis", range(3))
def test_a_command_that_is_not_a_number_is_refused_whole(axis):
    player = playing()
    player.tick(0, BASE)
    bad = list(BASE)
    bad[axis] = -(2**31)
    assert player.tick(100_000, bad) == list(BASE)
    assert player.counts.refused_commands == 1


@given(base=st.tuples(*[st.integers(-(2**31) + 1, 2**31 - 1)] * 3), limit=st.integers(0, MAX_Q20))
def test_no_output_exceeds_its_limit(base, limit):
    player = ShimPlayer(50_000, [limit] * 3)
    player.offer(message_image())
    assert all(abs(value) <= limit for value in player.tick(0, base))


@pytest.mark.parametrize(
    "setting",
    [
        {"rate_mhz": 999},
        {"rate_mhz": 1_000_001},
        {"hold_ms": 0},
        {"hold_ms": 250},
        {"zero_ms": 10_001},
        {"limits_q20": (-1, 1, 1)},
        {"limits_q20": (1, 1, MAX_Q20 + 1)},
    ],
)
def test_settings_outside_their_range_are_refused(setting):
    player = ShimPlayer(**({"rate_mhz": 50_000, "limits_q20": WIDE} | setting))
    assert player.started == player.lib.MTM_BAD_SETTINGS
