"""All attacks by name, in the order in which they are told."""

from hil.experiments.attacks import (
    additive_noise,
    band_stop,
    codebook_learning,
    desynchronisation,
    distillation,
    jamming,
    noise_replacement,
    prediction,
    relay,
    splice,
    steganalysis,
    whitening,
)
from hil.experiments.attacks.attack import Attack
from hil.experiments.runs.cells import Scalar, Values

ATTACKS: dict[str, Attack] = {
    module.ATTACK.name: module.ATTACK
    for module in (
        additive_noise, band_stop, noise_replacement, whitening, prediction, jamming, desynchronisation,
        codebook_learning, relay, splice, distillation, steganalysis,
    )
}  # fmt: skip


def measure_attack(parameters: Values, seed: int) -> dict[str, Scalar]:
    """What `Attack.measure` gives for a cell."""
    attack = ATTACKS[str(parameters["attack"])]
    arm, level = str(parameters["arm"]), float(parameters["level"])
    return dict(attack.measure(arm, level, int(parameters["rollouts"]), seed))
