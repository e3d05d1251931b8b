"""Attacks in the simulator, as small as they go."""

import pytest

pytest.importorskip("vmas")

from hil.experiments.attacks.codebook_learning import PERMUTED, PRESENT, ROLLING
from hil.experiments.attacks.desynchronisation import WARP
from hil.experiments.attacks.registry import ATTACKS, measure_attack


def measured(name, arm, level, rollouts=2):
    return measure_attack({"attack": name, "arm": arm, "level": level, "rollouts": rollouts}, 77_000)


def test_without_an_attack_every_message_is_read_by_both():
    found = measured("additive_noise", "white noise", 0.0)
    assert (found["coherency right"], found["matched right"], found["matched trials"]) == (16, 16, 16)
    # What is changed is what the limits cut.
    assert found["distortion"] < 0.02


@pytest.mark.parametrize(
    ("name", "arm", "level"),
    [("additive_noise", "white noise", 6.67), ("band_stop", "order of the prototype", 6.0),
     ("noise_replacement", "with noise of the same band", 1.0), ("codebook_learning", "rolling schedule", 2.0)],
)  # fmt: skip
def test_what_suppresses_or_forges_leaves_coherency_near_chance(name, arm, level):
    assert arm in ATTACKS[name].levels
    assert measured(name, arm, level)["coherency right"] <= 8


def test_a_learnt_codebook_forges_under_the_fixed_schedule():
    assert measured("codebook_learning", "fixed schedule", 4.0)["matched right"] >= 12


def test_an_order_for_each_slot_leaves_presence_to_forgers():
    found = measured("codebook_learning", PERMUTED, 4.0)
    assert found["matched right"] <= 6
    assert found[f"{PRESENT} right"] >= 10
    assert measured("codebook_learning", ROLLING, 4.0)["matched margin"] < 2.0 < found["matched margin"]


def test_a_detector_that_is_told_the_drift_follows_a_slow_warp():
    found = measured("desynchronisation", WARP, 4.0)
    assert found["matched, told delays and drifts right"] == 16
    assert found["matched right"] <= 10
