import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.guard import Guard, Limits, Staleness
from mtm_onboard.motion import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.journal_file import CLAMPED, HELD, NOISE, REFUSED, STALE, STOPPED, UNSENT

BASE = BodyVelocity(0.3, -0.1, 0.5)
NOISY = BodyVelocity(0.35, -0.2, 0.5)
HAIR = 1e-9


def plain_guard(**limits) -> Guard:
    bounds = Limits(**({"speed_mps": 1.0, "turn_rate_radps": 2.0} | limits))
    return Guard(bounds, Staleness(), noise_sigma=0.1, period_s=0.02)


def tick(guard: Guard, base: BodyVelocity, noise: BodyVelocity, arrived_s: float = 0.0, now_s: float = 0.0):
    admitted = guard.admit(base, arrived_s, now_s)
    wanted = BodyVelocity(*(a + b for a, b in zip(admitted, noise, strict=True)))
    return admitted, guard.limit(admitted, wanted)


def test_within_the_limits_the_command_is_not_touched():
    guard = plain_guard()
    base = guard.admit(BASE, 0.0, 0.01)
    assert base == BASE
    assert guard.limit(base, NOISY) == NOISY
    assert (guard.clamped, guard.stale, guard.refused, guard.flags) == (0, 0, 0, NOISE)


@pytest.mark.parametrize(
    ("age_s", "kept", "noise"),
    [(0.0, 1.0, True), (0.099, 1.0, True), (0.1, 1.0, False), (0.175, 0.5, False), (0.25, 0.0, False), (9, 0.0, False)],
)
def test_a_stale_command_loses_its_noise_first_and_then_its_speed(age_s, kept, noise):
    guard = plain_guard()
    base = guard.admit(BASE, 0.0, age_s)
    assert base == pytest.approx([kept * value for value in BASE])
    assert guard.noise_allowed is noise
    assert guard.limit(base, NOISY) == (NOISY if noise else base)
    assert guard.stale == (not noise)


def test_without_any_command_the_robot_stands_still():
    guard = plain_guard()
    assert guard.limit(guard.admit(STOP, -math.inf, 1.0), NOISY) == STOP
    assert guard.flags == STALE


def test_the_operator_s_stop_holds_whatever_comes_after_it():
    guard = plain_guard(acceleration_mps2=0.1)
    tick(guard, BASE, STOP)
    guard.stop()
    for now_s in (0.0, 1.0, 2.0):
        assert tick(guard, BASE, NOISY, now_s, now_s) == (STOP, STOP)
        assert guard.flags == STOPPED
    assert guard.stopped


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_not_finite_is_refused_and_the_last_good_one_ages(bad):
    guard = plain_guard()
    tick(guard, BASE, STOP, 0.0, 0.0)
    assert tick(guard, BodyVelocity(0.1, bad, 0.0), NOISY, 0.05, 0.05) == (BASE, BASE)
    assert (guard.flags, guard.refused) == (REFUSED, 1)
    assert guard.admit(BodyVelocity(bad, 0.1, 0.0), 0.3, 0.3) == STOP


def test_a_command_from_before_the_link_came_back_holds_the_robot_still():
    guard = plain_guard(acceleration_mps2=0.1)
    guard.admit(BASE, 0.0, 0.0)
    for arrived_s, after_s in ((0.0, 0.01), (0.01, 0.01), (0.02, math.inf)):
        assert guard.limit(guard.admit(BASE, arrived_s, 0.02, after_s=after_s), NOISY) == STOP
        assert guard.flags == HELD
        assert not guard.noise_allowed
    assert guard.held == 3
    assert guard.admit(BASE, 0.02, 0.02, after_s=0.01) == BASE
    # What is refused does not make the old command new.
    assert guard.admit(BodyVelocity(math.nan, 0.0, 0.0), 0.05, 0.06, after_s=0.05) == STOP


def test_a_command_that_never_left_is_not_what_the_next_one_accelerates_from():
    guard = plain_guard(acceleration_mps2=5.0)
    first = guard.limit(guard.admit(BASE, 0.0, 0.0), BASE)
    guard.limit(guard.admit(BASE, 0.02, 0.02), BASE)
    guard.not_sent()
    assert (guard.unsent, guard.flags & UNSENT) == (1, UNSENT)
    third = guard.limit(guard.admit(BASE, 0.04, 0.04), BASE)
    assert math.dist(first[:2], third[:2]) <= 0.1 + HAIR


def test_noise_that_is_not_finite_is_left_out():
    guard = plain_guard()
    assert guard.limit(guard.admit(BASE, 0.0, 0.0), BodyVelocity(math.nan, 0.0, 0.0)) == BASE
    assert guard.flags == REFUSED


def test_noise_is_bounded_in_multiples_of_sigma():
    guard = plain_guard(noise_sigmas=2.0)
    _, sent = tick(guard, STOP, BodyVelocity(0.5, -0.1, -0.3))
    assert sent == pytest.approx((0.2, -0.1, -0.2))
    assert guard.flags == NOISE | CLAMPED


def test_noise_gives_way_at_the_speed_limit_and_the_base_command_stays():
    guard = plain_guard()
    fastest = BodyVelocity(1.0, 0.0, 2.0)
    assert tick(guard, fastest, BodyVelocity(0.2, 0.0, 0.1)) == (fastest, fastest)
    _, inward = tick(guard, fastest, BodyVelocity(-0.2, 0.0, -0.1))
    assert inward == pytest.approx((0.8, 0.0, 1.9))
    assert guard.clamped == 1


def test_a_base_command_above_the_limits_keeps_its_direction_and_is_counted():
    guard = plain_guard()
    base = guard.admit(BodyVelocity(3.0, -4.0, -9.0), 0.0, 0.0)
    assert base == pytest.approx((0.6, -0.8, -2.0))
    assert (guard.clamped, guard.flags) == (1, CLAMPED)
    guard.limit(base, BodyVelocity(1.5, -2.0, -3.0))
    assert guard.clamped == 1  # a tick counts once, though its noise was clamped as well


def test_the_acceleration_limit_takes_the_noise_before_it_slows_the_base_command():
    guard = plain_guard(acceleration_mps2=1.0)  # 0.02 m/s a tick
    for step in range(1, 16):
        _, sent = tick(guard, BodyVelocity(0.3, 0.0, 0.0), BodyVelocity(0.1, 0.0, 0.0))
        assert sent.vx_mps == pytest.approx(0.02 * step)
    _, sent = tick(guard, BodyVelocity(0.3, 0.0, 0.0), BodyVelocity(0.1, 0.0, 0.0))
    assert sent.vx_mps == pytest.approx(0.32)


def test_the_acceleration_limit_never_delays_a_stop():
    guard = plain_guard(acceleration_mps2=0.1)
    for _ in range(200):
        tick(guard, BASE, STOP)
    assert tick(guard, BASE, STOP, 0.0, 0.25) == (STOP, STOP)


speeds = st.floats(-1e3, 1e3) | st.sampled_from([0.0, 1e300, -1e300, math.nan, math.inf, -math.inf])
velocities = st.builds(BodyVelocity, speeds, speeds, speeds)
ticks = st.lists(st.tuples(velocities, velocities, st.floats(0, 0.4)), min_size=1, max_size=8)


@given(ticks, st.sampled_from([None, 0.5, 30.0]))
def test_what_is_sent_is_always_finite_and_within_every_limit(commands, acceleration):
    guard = plain_guard(acceleration_mps2=acceleration, noise_sigmas=3.0)
    last = STOP
    for base, noise, age_s in commands:
        admitted, sent = tick(guard, base, noise, 10.0 - age_s, 10.0)
        assert sent.is_finite()
        assert math.hypot(sent.vx_mps, sent.vy_mps) <= 1.0 + HAIR
        assert abs(sent.wz_radps) <= 2.0 + HAIR
        assert abs(sent.wz_radps - admitted.wz_radps) <= 0.3 + HAIR
        step = math.hypot(sent.vx_mps - last.vx_mps, sent.vy_mps - last.vy_mps)
        if acceleration is None:
            assert max(abs(sent.vx_mps - admitted.vx_mps), abs(sent.vy_mps - admitted.vy_mps)) <= 0.3 + HAIR
        elif not guard.flags & STALE:
            assert step <= acceleration * 0.02 + HAIR
        last = sent


@given(velocities, velocities, st.floats(0.1, 1.0))
def test_whatever_is_wrong_with_the_base_command_no_noise_is_sent(base, noise, age_s):
    guard = plain_guard()
    admitted, sent = tick(guard, base, noise, -age_s, 0.0)
    assert sent == admitted
    assert not guard.flags & NOISE


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_limits_and_ages_that_make_no_sense_are_refused(bad):
    with pytest.raises(MtmError, match="speed_mps"):
        Limits(bad, 1.0)
    with pytest.raises(MtmError, match="acceleration_mps2"):
        Limits(1.0, 1.0, acceleration_mps2=bad)
    with pytest.raises(MtmError, match="noise off before the stop"):
        Staleness(bad, 0.0)
