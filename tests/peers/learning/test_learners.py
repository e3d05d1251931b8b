"""The policies' noise with a real stable-baselines3 and its real environments."""

import json

import numpy as np
import pytest

from mtm_onboard.protocol import Key, save_key
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.schemes import FAKE_SECRET, small_codebook, small_scheme
from tests.peers.conftest import ROOT, installed

pytestmark = pytest.mark.peer
SIGMA = 0.1


@pytest.fixture
def case(start, tmp_path):
    save_key(Key("fake-key", FAKE_SECRET, small_scheme()), tmp_path / "r.key")

    def run(name: str) -> dict:
        script = ROOT / "tests/peers/learning/learners.py"
        learner = start(installed("learning"), script, tmp_path / "r.key", name, OMP_NUM_THREADS="1")
        assert learner.end(180.0) == 0, learner.output
        return json.loads(learner.lines[-1])

    return run


def noise(ticks, symbol: int = 1) -> np.ndarray:
    modulator = Modulator(small_codebook(), "a", (symbol,))
    return np.array([modulator.perturbation(tick) for tick in ticks])


@pytest.mark.parametrize(("name", "environments"), [("TD3", 1), ("TD3 four", 4)])
def test_a_deterministic_learner_explores_with_the_message(case, name, environments):
    got = case(name)["got"]
    assert len(got) == environments
    for number, actions in enumerate(got):
        assert np.array(actions) == pytest.approx(SIGMA * noise(range(200), number), abs=1e-6)


def test_a_squashed_gaussian_learner_has_the_message_as_well(case):
    actions = np.array(case("SAC")["got"][0])
    wanted = SIGMA * noise(range(200), 0)
    # SAC draws as well, far louder, so the message shows on the average alone: the slope on it is one.
    slope = np.sum(wanted * actions) / np.sum(wanted**2)
    scatter = np.std(actions - wanted) / np.sqrt(np.sum(wanted**2))
    assert abs(slope - 1.0) < 4.0 * scatter
    assert scatter < 0.5


def test_the_wrapper_adds_the_message_to_what_ppo_chose(case):
    seen = case("PPO")
    wanted = np.clip(np.array(seen["chosen"]) + SIGMA * noise(range(200)), -1.0, 1.0)
    assert np.array(seen["got"][0]) == pytest.approx(wanted, abs=1e-6)


def test_the_message_takes_the_place_of_a_ppo_policy_s_epsilon(case):
    seen = case("gaussian")
    mean, deviation = (np.array(part) for part in zip(*seen["seen"], strict=True))
    assert np.array(seen["got"][0]) == pytest.approx(mean + deviation * noise(range(200)), abs=1e-5)


def test_a_vector_environment_s_resetting_steps_shift_no_tick(case):
    reached = [tick for tick in range(160) if tick not in (50, 101, 152)]
    for number, actions in enumerate(case("vector")["got"]):
        assert np.array(actions) == pytest.approx(SIGMA * noise(reached, number + 1), abs=1e-6)
