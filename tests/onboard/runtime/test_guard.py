import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import Channel, MtmError
from mtm_onboard.protocol.journal_file import CLAMPED, HELD, NOISE, REFUSED, STALE, STOPPED, UNSENT
from mtm_onboard.runtime.guard import Guard, Limits, Staleness, body_sigmas

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


def test_before_its_first_tick_a_guard_has_seen_nothing():
    guard = plain_guard()
    assert (guard.flags, guard.stopped) == (0, False)
    assert (guard.clamped, guard.stale, guard.refused, guard.held, guard.unsent) == (0, 0, 0, 0, 0)


def test_a_command_without_noise_is_not_flagged_as_one_with_it():
    guard = plain_guard()
    base = guard.admit(BASE, 0.0, 0.0)
    assert guard.limit(base, base) == BASE
    assert guard.flags == 0


@pytest.mark.parametrize(
    ("age_s", "kept", "noise"),
    [(0.0, 1.0, True), (0.099, 1.0, True), (0.1, 1.0, False), (0.175, 0.5, False), (0.25, 0.0, False), (9, 0.0, False)],
)
def test_a_stale_command_loses_its_noise_and_then_its_speed(age_s, kept, noise):
    guard = plain_guard()
    base = guard.admit(BASE, 0.0, age_s)
    assert base == pytest.approx([kept * value for value in BASE])
    assert guard.noise_allowed is noise
    assert guard.limit(base, NOISY) == (NOISY if noise else base)
    assert guard.stale == (not noise)


def test_a_stale_command_beyond_limits_is_clamped_and_ramped():
    guard = plain_guard()
    assert guard.admit(BodyVelocity(3.0, -4.0, -9.0), 0.0, 0.175) == pytest.approx((0.3, -0.4, -1.0))
    assert guard.flags == STALE | CLAMPED


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
def test_a_command_that_is_not_finite_is_refused(bad):
    guard = plain_guard()
    tick(guard, BASE, STOP, 0.0, 0.0)
    assert tick(guard, BodyVelocity(0.1, bad, 0.0), NOISY, 0.05, 0.05) == (BASE, BASE)
    assert (guard.flags, guard.refused) == (REFUSED, 1)
    assert guard.admit(BodyVelocity(bad, 0.1, 0.0), 0.3, 0.3) == STOP


def test_a_first_command_that_is_not_finite_is_as_good_as_none():
    guard = plain_guard()
    assert guard.admit(BodyVelocity(math.nan, 0.0, 0.0), 0.0, 0.0) == STOP
    assert (guard.flags, guard.stale) == (REFUSED | STALE, 1)


def test_a_command_from_before_the_link_s_return_holds_still():
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


def test_no_stop_waits_for_the_acceleration_limit():
    for after_s, is_stopped in ((math.inf, False), (-math.inf, True)):
        guard = plain_guard(acceleration_mps2=1.0)
        for _ in range(20):
            tick(guard, BASE, STOP)
        if is_stopped:
            guard.stop()
        base = guard.admit(BASE, 0.02, 0.02, after_s=after_s)
        assert guard.limit(base, NOISY) == STOP


def test_a_command_that_never_left_is_not_accelerated_from():
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
    assert (guard.flags, guard.refused) == (REFUSED, 1)


def test_noise_is_bounded_in_multiples_of_sigma():
    guard = plain_guard(noise_sigmas=2.0)
    _, sent = tick(guard, STOP, BodyVelocity(0.5, -0.1, -0.3))
    assert sent == pytest.approx((0.2, -0.1, -0.2))
    assert guard.flags == NOISE | CLAMPED


def test_each_axis_s_noise_is_bounded_by_its_own_sigma():
    bounds = Limits(1.0, 2.0, noise_sigmas=2.0)
    guard = Guard(bounds, Staleness(), noise_sigma=(0.1, 0.0, 0.2), period_s=0.02)
    _, sent = tick(guard, STOP, BodyVelocity(0.5, 0.3, -0.5))
    assert sent == pytest.approx((0.2, 0.0, -0.4))


def test_a_body_s_sigmas_are_those_of_its_channels():
    channels = [Channel("a", "a", ("wz", "vx"), 1, (0.2, 0.1)), Channel("b", "a", ("joint",), 1, 3.0)]
    assert body_sigmas(channels) == (0.1, 0.0, 0.2)
    assert body_sigmas([]) == (0.0, 0.0, 0.0)


def test_noise_is_bounded_by_four_sigma_unless_said_otherwise():
    _, sent = tick(plain_guard(), STOP, BodyVelocity(0.5, -0.5, 0.5))
    assert sent == pytest.approx((0.4, -0.4, 0.4))


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("base", "noise"),
    [
        ((0.0, 0.0, 0.0), (0.4, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (0.0, 0.4, 0.0)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.4)),
        ((0.75, 0.0, 0.0), (0.25, 0.0, 0.0)),
        ((0.0, 0.0, 1.75), (0.0, 0.0, 0.25)),
    ],
)
def test_noise_that_just_fits_is_left_as_it_is(base, noise, sign):
    guard = plain_guard()
    base, noise = (BodyVelocity(*(sign * value for value in each)) for each in (base, noise))
    admitted, sent = tick(guard, base, noise)
    assert (guard.clamped, guard.flags) == (0, NOISE)
    assert sent == tuple(one + other for one, other in zip(admitted, noise, strict=True))


@pytest.mark.parametrize("speed_mps", [0.5, 1.0])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("base", "noise"),
    [((0.6, 0.3), (0.3, 0.35)), ((0.6, -0.7), (-0.2, -0.3)), ((-0.5, 0.8), (0.3, 0.3)), ((0.0, 0.9), (0.3, 0.1))],
)
def test_as_much_of_the_noise_is_kept_as_the_speed_limit_allows(base, noise, sign, speed_mps):
    guard = plain_guard(speed_mps=speed_mps)
    base_x, base_y = (sign * speed_mps * value for value in base)
    noise_x, noise_y = (sign * speed_mps * value for value in noise)
    _, sent = tick(guard, BodyVelocity(base_x, base_y, 0.1), BodyVelocity(noise_x, noise_y, 0.2))
    kept_x, kept_y = sent.vx_mps - base_x, sent.vy_mps - base_y
    assert math.hypot(sent.vx_mps, sent.vy_mps) == pytest.approx(speed_mps, abs=1e-12)
    assert kept_x * noise_y - kept_y * noise_x == pytest.approx(0.0, abs=1e-12)
    assert kept_x * noise_x + kept_y * noise_y > 0.0
    assert sent.wz_radps == pytest.approx(0.3)


def test_at_the_speed_limit_the_noise_of_the_turn_rate_is_kept():
    # In some directions a speed that was cut to the limit is rounded to a hair above it.
    for degrees in range(360):
        angle_rad = math.radians(degrees)
        fast = BodyVelocity(5.0 * math.cos(angle_rad), 5.0 * math.sin(angle_rad), 0.0)
        admitted, sent = tick(plain_guard(), fast, BodyVelocity(0.0, 0.0, 0.1))
        assert sent == (*admitted[:2], 0.1)


def test_noise_gives_way_at_the_speed_limit():
    guard = plain_guard()
    fastest = BodyVelocity(1.0, 0.0, 2.0)
    assert tick(guard, fastest, BodyVelocity(0.2, 0.0, 0.1)) == (fastest, fastest)
    _, inward = tick(guard, fastest, BodyVelocity(-0.2, 0.0, -0.1))
    assert inward == pytest.approx((0.8, 0.0, 1.9))
    assert guard.clamped == 1


def test_a_base_command_above_the_limits_keeps_its_direction():
    guard = plain_guard()
    base = guard.admit(BodyVelocity(3.0, -4.0, -9.0), 0.0, 0.0)
    assert base == pytest.approx((0.6, -0.8, -2.0))
    assert (guard.clamped, guard.flags) == (1, CLAMPED)
    guard.limit(base, BodyVelocity(1.5, -2.0, -3.0))
    assert guard.clamped == 1  # a tick counts once, though its noise was clamped as well


def test_a_turn_rate_above_its_limit_leaves_the_speed_as_it_is():
    assert plain_guard().admit(BodyVelocity(0.3, -0.1, 9.0), 0.0, 0.0) == (0.3, -0.1, 2.0)


def test_acceleration_is_straight_towards_the_base_command():
    guard = plain_guard(acceleration_mps2=1.0)  # 0.02 m/s a tick
    target = BodyVelocity(0.3, -0.4, 0.2)
    for step in range(1, 26):
        _, sent = tick(guard, target, STOP)
        assert sent == pytest.approx((0.012 * step, -0.016 * step, 0.2))
    other = BodyVelocity(-0.1, 0.2, 0.7)
    _, sent = tick(guard, other, BodyVelocity(0.1, 0.1, 0.1))
    part = 0.02 / math.hypot(0.4, 0.6)
    assert sent == pytest.approx((0.3 - 0.4 * part, -0.4 + 0.6 * part, 0.7))
    assert guard.flags == CLAMPED


def test_noise_is_kept_as_the_acceleration_limit_allows():
    guard = plain_guard(acceleration_mps2=1.0)
    for _ in range(30):
        tick(guard, BodyVelocity(0.3, -0.4, 0.2), STOP)
    clamped = guard.clamped
    base, noise = BodyVelocity(0.305, -0.41, 0.7), BodyVelocity(0.1, -0.05, 0.1)
    _, sent = tick(guard, base, noise)
    assert math.dist(sent[:2], (0.3, -0.4)) == pytest.approx(0.02, abs=1e-12)
    kept_x, kept_y = sent.vx_mps - base.vx_mps, sent.vy_mps - base.vy_mps
    assert kept_x > 0.0
    assert kept_y / kept_x == pytest.approx(-0.5)
    assert sent.wz_radps == pytest.approx(0.8)
    assert (guard.flags, guard.clamped - clamped) == (NOISE | CLAMPED, 1)


def test_a_change_of_speed_that_just_fits_is_no_clamp():
    guard = plain_guard(acceleration_mps2=1.0)
    assert tick(guard, BodyVelocity(0.02, 0.0, 0.0), STOP)[1] == (0.02, 0.0, 0.0)
    assert guard.clamped == 0


def test_the_acceleration_limit_takes_the_noise_first():
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
def test_with_a_wrong_base_command_no_noise_is_sent(base, noise, age_s):
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
    for ages_s in ((bad, 0.25), (0.1, bad), (0.1, 0.1)):
        with pytest.raises(MtmError, match="noise off before the stop"):
            Staleness(*ages_s)
