import copy
import pickle
from itertools import count

import numpy as np
import pytest

from mtm_onboard.policies import KeyedNoise, VectorKeyedNoise
from mtm_onboard.protocol import MtmError
from mtm_onboard.runtime.message import SILENCE
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.schemes import FAKE_SECRET, small_codebook


def modulator(channel="a", message=(1,), **options) -> Modulator:
    return Modulator(small_codebook(), channel, message, **options)


def steps(noise, number) -> np.ndarray:
    return np.array([noise() for _ in range(number)])


def message(channel="a", symbols=(1,), ticks=range(240)) -> np.ndarray:
    whole = modulator(channel, symbols)
    return np.array([whole.perturbation(tick) for tick in ticks])


def test_each_call_is_a_tick_of_the_message():
    assert np.array_equal(steps(KeyedNoise([modulator()]), 240), message())


def test_channels_go_to_the_components_that_their_axes_name():
    noise = KeyedNoise([modulator(), modulator("b", (3, 0, 2))], ("wz", "gripper", "vy", "vx"))
    rows = steps(noise, 240)
    assert np.array_equal(rows[:, [3, 2]], message())
    assert np.array_equal(rows[:, [0]], message("b", (3, 0, 2)))
    assert not rows[:, 1].any()
    assert noise.sigma.tolist() == [0.2, 0.0, 0.1, 0.1]


def test_noise_is_random_outside_messages_with_a_generator():
    modulators = [modulator(repeat=False), modulator("b", SILENCE)]
    rows = steps(KeyedNoise(modulators, random=np.random.default_rng(1)), 3000)
    assert np.array_equal(rows[:120, :2], message(ticks=range(120)))
    for elsewhere in (rows[120:, 0], rows[120:, 1], rows[:, 2]):
        assert np.mean(elsewhere) == pytest.approx(0.0, abs=0.08)
        assert np.std(elsewhere) == pytest.approx(1.0, abs=0.06)


def test_a_queued_message_begins_at_the_next_boundary():
    playing = modulator(message=SILENCE)
    noise = KeyedNoise([playing])
    before = steps(noise, 50)
    playing.queue((1,))
    after = steps(noise, 310)
    assert not before.any()
    assert not after[:70].any()
    assert np.array_equal(after[70:], message())


def test_a_late_step_shifts_nothing():
    ticks = [5, 6, 9, 9, 140]
    assert np.array_equal(steps(KeyedNoise([modulator()], tick=iter(ticks).__next__), 5), message(ticks=ticks))


def test_environments_have_their_own_keys_channels_and_phases():
    noises = [
        KeyedNoise([modulator()]),
        KeyedNoise([modulator(message=(2,))], tick=count(30).__next__),
        KeyedNoise([modulator("b", (3, 0, 2))], ("vx", "wz")),
    ]
    vector = VectorKeyedNoise(noises)
    rows = steps(vector, 200)
    assert rows.shape == (200, 3, 2)
    assert np.array_equal(rows[:, 0], message(ticks=range(200)))
    assert np.array_equal(rows[:, 1], message(symbols=(2,), ticks=range(30, 230)))
    assert np.array_equal(rows[:, 2, 1:], message("b", (3, 0, 2), range(200)))
    assert vector.sigma.tolist() == [[0.1, 0.1], [0.1, 0.1], [0.0, 0.2]]


def test_environments_that_share_or_differ_are_refused():
    shared = modulator()
    with pytest.raises(MtmError, match="share a modulator"):
        VectorKeyedNoise([KeyedNoise([shared]), KeyedNoise([shared])])
    with pytest.raises(MtmError, match="differ in size"):
        VectorKeyedNoise([KeyedNoise([modulator()]), KeyedNoise([modulator("b", (1, 1, 1))])])
    with pytest.raises(MtmError, match="one noise or more"):
        VectorKeyedNoise([])


@pytest.mark.parametrize("copied", [lambda noise: pickle.loads(pickle.dumps(noise)), copy.deepcopy, copy.copy])
def test_a_copy_has_no_key_and_says_so(copied):
    noise = KeyedNoise([modulator()], random=np.random.default_rng(1))
    assert FAKE_SECRET not in pickle.dumps(noise)
    with pytest.raises(MtmError, match="a copy has no key"):
        copied(noise)()
    assert np.array_equal(steps(noise, 10), message(ticks=range(10)))


@pytest.mark.parametrize(
    ("channels", "axes", "says"),
    [
        ("", None, "no channel"),
        ("aa", None, "channels have the axis 'vx' twice"),
        ("a", ("vx", "vy", "vx"), "action have the axis 'vx' twice"),
        ("ab", ("vx", "vy"), "no component 'wz'"),
    ],
)
def test_axes_that_do_not_fit_the_channels_are_refused(channels, axes, says):
    messages = {"a": (1,), "b": (3, 0, 2)}
    with pytest.raises(MtmError, match=says):
        KeyedNoise([modulator(channel, messages[channel]) for channel in channels], axes)
