import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import kstest

from mtm_onboard.policies import ActionBounds, KeyedGaussian, KeyedNoise, VectorKeyedNoise
from mtm_onboard.protocol import Channel, Codebook, MtmError
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.schemes import FAKE_SECRET, small_scheme

MEAN, STD = np.array([0.2, -0.4]), np.array([0.5, 2.0])
# Two tones a window: what is not exactly Gaussian shows.
TWO_TONES = {"band_hz": (2.0, 2.9), "channels": (Channel("a", "a", ("vx", "vy"), 1, 0.1),)}


def noise_of(secret=FAKE_SECRET, first_tick=0, message=(1,), **changes) -> KeyedNoise:
    modulator = Modulator(Codebook(secret, small_scheme(**changes)), "a", message)
    ticks = iter(range(first_tick, 10_000))
    return KeyedNoise([modulator], tick=ticks.__next__, random=np.random.default_rng(1))


def test_an_action_is_the_mean_and_the_keyed_noise():
    policy = KeyedGaussian(lambda observation: (observation + MEAN, STD), noise_of())
    eps = noise_of()
    for step in range(130):
        assert policy(step) == pytest.approx(step + MEAN + STD * eps())


def test_several_environments_act_at_once():
    vector = VectorKeyedNoise([noise_of(), noise_of(first_tick=40)])
    actions = KeyedGaussian(lambda means: (means, STD), vector)(np.array([MEAN, -MEAN]))
    assert actions == pytest.approx(np.array([MEAN, -MEAN]) + STD * np.array([noise_of()(), noise_of(first_tick=40)()]))


def actions_over_keys(first_tick: int, keys: int, **changes) -> np.ndarray:
    secrets = (number.to_bytes(32, "big") for number in range(keys))
    return np.array(
        [KeyedGaussian(lambda _: (MEAN, STD), noise_of(secret, first_tick, **changes))(None) for secret in secrets]
    )


@pytest.mark.parametrize("tick", [0, 57, 119, 300])
@pytest.mark.parametrize("band", [{}, TWO_TONES], ids=["many tones", "two tones"])
def test_over_the_keys_an_action_has_the_policy_s_distribution(tick, band):
    standardised = (actions_over_keys(tick, 400, power="ensemble", **band) - MEAN) / STD
    for column in standardised.T:
        assert kstest(column, "norm").pvalue > 1e-3


def test_a_window_of_fixed_power_and_few_tones_is_not_gaussian():
    standardised = (actions_over_keys(57, 2000, power="window", **TWO_TONES) - MEAN) / STD
    assert kstest(standardised[:, 0], "norm").pvalue < 1e-3


def test_a_policy_without_noise_outside_messages_is_refused():
    silent = KeyedNoise([Modulator(Codebook(FAKE_SECRET, small_scheme()), "a", (1,))])
    for noise in (silent, VectorKeyedNoise([noise_of(), silent])):
        with pytest.raises(MtmError, match="default_rng"):
            KeyedGaussian(lambda _: (MEAN, STD), noise)


def test_actions_beyond_the_bounds_are_clipped_and_counted():
    bounds = ActionBounds(-1.0, (1.0, 0.5))
    policy = KeyedGaussian(lambda mean: (mean, np.zeros(2)), noise_of(), bounds)
    assert bounds.clipped_share == 0.0
    assert [policy(np.array(mean)).tolist() for mean in ([0.0, 0.5], [2.0, 0.7], [-1.0, -1.5], [1.0, 0.0])] == [
        [0.0, 0.5], [1.0, 0.5], [-1.0, -1.0], [1.0, 0.0],
    ]  # fmt: skip
    assert (bounds.actions, bounds.clipped, bounds.clipped_share) == (4, 2, 0.5)


@given(arrays(np.float64, st.tuples(st.integers(1, 5), st.just(3)), elements=st.floats(-10, 10)))
def test_bounds_count_each_environment_s_cut_action(actions):
    bounds = ActionBounds((-1.0, -2.0, -np.inf), (1.0, 2.0, 5.0))
    within = bounds.clip(actions)
    assert np.all((within >= (-1.0, -2.0, -np.inf)) & (within <= (1.0, 2.0, 5.0)))
    changed = [row for row, kept in zip(actions, within, strict=True) if not np.array_equal(row, kept)]
    assert (bounds.actions, bounds.clipped) == (len(actions), len(changed))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_action_that_is_not_finite_goes_nowhere(bad):
    with pytest.raises(MtmError, match="not finite"):
        ActionBounds(-1.0, 1.0).clip(np.array([0.0, bad]))


def test_bounds_that_leave_no_room_are_refused():
    with pytest.raises(MtmError, match="low <= high"):
        ActionBounds((0.0, 1.0), (1.0, 0.5))
