import numpy as np
import pytest

from hil.experiments.worlds.genie import fit_genie, genie_scores, known_shots
from hil.experiments.worlds.reading import ObservedShot
from hil.worlds.noise import keyed_noise
from hil.worlds.schemes import same_scheme
from mtm_audit.model.glimpse import Glimpse
from mtm_onboard.protocol import Codebook

SCHEME = same_scheme("discovery", 8, 40, 1)
AXES = ("agent.vx", "agent.vy")
KERNEL = np.array([0.6, 0.3, 0.1])


def recorded(seed, messages=8):
    """A body that answers its commands with a known kernel and trembles."""
    generator = np.random.default_rng(seed)
    codebook = Codebook(generator.bytes(32), SCHEME)
    symbols = [(int(symbol),) for symbol in generator.integers(8, size=messages)]
    noise = keyed_noise(codebook, symbols, AXES)
    moved = np.stack([np.convolve(column, KERNEL)[: len(noise)] for column in noise.T], axis=1)
    velocities = moved + 0.01 * generator.standard_normal(noise.shape)
    edges_s = np.arange(len(noise) + 1) / SCHEME.rate_hz
    glimpse = Glimpse("agent", edges_s, velocities, np.ones(len(noise), dtype=bool), ("x", "y"))
    return codebook, [ObservedShot(0.0, range(len(noise)), {"agent": glimpse})], symbols


@pytest.fixture(scope="module")
def knowledge():
    return fit_genie([known for seed in range(20) for own in known_shots(*recorded(seed)) for known in own])


def test_the_response_is_learned_in_its_band(knowledge):
    # Outside of the band nothing was played, so that only the response to tones inside of it is known.
    turns = np.exp(-2j * np.pi * 0.15 * np.arange(knowledge.taps.shape[2]))
    response = knowledge.taps @ turns
    expected = KERNEL @ turns[: len(KERNEL)]
    assert response == pytest.approx(np.eye(2) * expected, abs=0.03)


def test_what_was_sent_is_the_likeliest(knowledge):
    codebook, seen, symbols = recorded(100)
    (own,) = known_shots(codebook, seen, symbols)
    scores = genie_scores(knowledge, codebook, own, seen, SCHEME.channels[0])
    assert np.argmax(scores, axis=1).tolist() == [symbol for (symbol,) in symbols]
