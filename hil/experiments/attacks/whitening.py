"""The noise through a whitening filter: what is new in each sample alone, as loud as before.

By somebody who knows the policy, and has learnt the noise's correlation from other rollouts. The level is the order
of the linear prediction whose error is left.
"""

from collections.abc import Mapping

import numpy as np

from hil.experiments.attacks.attack import Attack
from hil.experiments.attacks.driving import CHANCE_PERCENT, SIGMA_MPS, overheard, suppressed
from hil.experiments.attacks.foretelling import fitted, lagged
from hil.experiments.runs.cells import Scalar
from hil.worlds.discovery import Tamper, Tick
from mtm_audit.model.track import Floats

ARM = "linear prediction's error"
_LEVELS = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)


def whitening_weights(noise: Floats, order: int) -> Floats:
    """(order,): how the next sample of noise (rollouts, ticks, 2) follows from those before, the newest first."""
    series = noise.transpose(0, 2, 1).reshape(-1, noise.shape[1])
    features = lagged(series, range(1, order + 1))[:, order:]
    return fitted(features.reshape(-1, order), series[:, order:].ravel())


def whitening(weights: Floats, rollouts: int) -> Tamper:
    """Leaves of the noise what the weights do not foretell from its past, as loud as the noise was."""
    past = np.zeros((len(weights), rollouts, 2))
    heard: list[Floats] = []

    def tamper(tick: Tick) -> Floats:
        noise = tick.requested_mps - tick.base_mps
        new = noise - np.tensordot(weights, past, axes=1)
        past[1:] = past[:-1].copy()
        past[:1] = noise
        heard.append(new)
        loudness = np.sqrt(np.mean(np.square(heard[-100:])))
        louder: Floats = tick.base_mps + new * (SIGMA_MPS / max(float(loudness), 1e-9))
        return louder

    return tamper


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    weights = whitening_weights(overheard()[0], round(level)) if level else np.zeros(0)
    return suppressed(lambda count, draw: whitening(weights, count), rollouts, seed)


ATTACK = Attack(
    name="whitening", level="order of the prediction", counted="messages right", levels={ARM: _LEVELS},
    measure=_measure, chance_percent=CHANCE_PERCENT,
)  # fmt: skip
