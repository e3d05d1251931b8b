import numpy as np
import pytest

from hil.experiments.worlds.reading import COHERENCY, MATCHED, ObservedShot, pooled_scores, read_windows
from hil.worlds.noise import keyed_noise
from hil.worlds.schemes import same_scheme, split_scheme
from mtm_audit.model.glimpse import Glimpse
from mtm_onboard.protocol import Codebook

SECRET = b"not a real secret, only for test"
AXES = {"agent": ("vx", "vy"), "lander": ("vx", "vy")}


def moved(body, noise, rate_hz, start_s=0.0, first_tick=0):
    """What is seen of a body that follows its noise and trembles."""
    trembling = 0.2 * noise.std() * np.random.default_rng(first_tick).standard_normal(noise.shape)
    edges_s = start_s + np.arange(len(noise) + 1) / rate_hz
    glimpse = Glimpse(body, edges_s, noise + trembling, np.ones(len(noise), dtype=bool), ("x", "y"))
    return ObservedShot(start_s, range(first_tick, first_tick + len(noise)), {body: glimpse})


@pytest.mark.parametrize("detector", [COHERENCY, MATCHED])
def test_messages_in_a_row_are_read_in_their_order(detector):
    codebook = Codebook(SECRET, same_scheme("discovery", 8, 60, 1))
    symbols = [3, 0, 7, 5]
    noise = keyed_noise(codebook, [(symbol,) for symbol in symbols], ("agent.vx", "agent.vy"))
    (scores,) = read_windows(codebook, [moved("agent", noise, 10.0)], 4, detector)
    assert np.argmax(scores, axis=1).tolist() == symbols


@pytest.mark.parametrize("detector", [COHERENCY, MATCHED])
def test_shots_with_a_cut_between_are_read_by_their_own_clocks(detector):
    codebook = Codebook(SECRET, same_scheme("discovery", 8, 60, 1))
    noise = keyed_noise(codebook, [(2,), (6,), (1,)], ("agent.vx", "agent.vy"))
    shots = [moved("agent", noise[first : first + 60], 10.0, 50.0 + first, first) for first in (0, 60, 120)]
    (scores,) = read_windows(codebook, shots, 3, detector)
    assert np.argmax(scores, axis=1).tolist() == [2, 6, 1]


@pytest.mark.parametrize("detector", [COHERENCY, MATCHED])
def test_axes_that_say_different_things_are_read_apart(detector):
    codebook = Codebook(SECRET, split_scheme("lunar-lander", 4, 576, (2, 3)))
    noise = keyed_noise(codebook, [(1, 3, 0, 2, 2)], ("lander.vx", "lander.vy"))
    side, main = read_windows(codebook, [moved("lander", noise, 50.0)], 1, detector)
    assert np.argmax(side, axis=1).tolist() == [1, 3]
    assert np.argmax(main, axis=1).tolist() == [0, 2, 2]


def test_coherencies_are_averaged_and_likelihoods_multiplied():
    scores = [np.array([[1.0, 2.0]]), np.array([[3.0, 6.0]])]
    assert pooled_scores(scores, COHERENCY).tolist() == [[2.0, 4.0]]
    assert pooled_scores(scores, MATCHED).tolist() == [[4.0, 8.0]]
