"""The gains with which a waveform may reach a recording: a prior over cameras, fixed before anything is recorded.

A camera turns, mirrors and scales the axes of a robot; how loud the waveform is beside the interference nobody knows.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mtm_audit.model.track import Floats

# In units of the interference's innovation per unit of waveform: an eighth to eight, in steps of 3 dB.
MAGNITUDES: Floats = 2.0 ** np.arange(-3.0, 3.01, 0.5)
# The interference is fitted to motion that holds the message, and so taken for louder than it is where the message is
# loud. Each level says how much of the message's own power is taken off again, with its prior probability.
RELIEFS = (0.0, 0.8)
RELIEF_PRIORS = (0.75, 0.25)
_TURNS = 16
# Interference never vanishes altogether.
_LARGEST_SHARE = 0.95


@dataclass(frozen=True)
class Levels:
    """Loudness hypotheses: `magnitudes`, `reliefs` and `log_priors`, each (levels,)."""

    magnitudes: Floats
    reliefs: Floats
    log_priors: Floats


@lru_cache(maxsize=1)
def all_levels() -> Levels:
    """Every magnitude with every relief; the priors add up to 1."""
    magnitudes = np.tile(MAGNITUDES, len(RELIEFS))
    priors = np.repeat(RELIEF_PRIORS, len(MAGNITUDES)) / len(MAGNITUDES)
    return Levels(magnitudes, np.repeat(RELIEFS, len(MAGNITUDES)), np.log(priors))


@lru_cache(maxsize=8)
def orientations(observed: int, injected: int) -> Floats:
    """Unit gains of `injected` axes on `observed` ones, (orientations, observed, injected), all equally probable.

    Two axes seen on two: the turns of a plain and of a mirrored camera. One on two, or two on one: directions. Else
    each axis on its own observed one, with either sign.
    """
    angles = np.arange(_TURNS) * (2.0 * np.pi / _TURNS)
    cosine, sine = np.cos(angles), np.sin(angles)
    if (observed, injected) == (2, 2):
        plain = np.stack([np.stack([cosine, -sine], -1), np.stack([sine, cosine], -1)], 1)
        return np.concatenate([plain, plain * np.array([1.0, -1.0])])
    if (observed, injected) == (2, 1):
        return np.stack([cosine, sine], -1)[:, :, None]
    if (observed, injected) == (1, 2):
        return np.stack([cosine, sine], -1)[:, None, :]
    shared = min(observed, injected)
    signs = 1.0 - 2.0 * ((np.arange(2**shared)[:, None] >> np.arange(shared)) & 1)
    result = np.zeros((len(signs), observed, injected))
    result[:, np.arange(shared), np.arange(shared)] = signs
    return result


def precision_factors(levels: Levels, power: Floats, cells: float) -> Floats:
    """How much quieter the interference is than fitted, (levels, ..., K) >= 1, for responses of `power` (..., K)."""
    magnitudes = levels.magnitudes.reshape(-1, *[1] * power.ndim)
    reliefs = levels.reliefs.reshape(-1, *[1] * power.ndim)
    share = np.minimum(magnitudes**2 * power * (0.5 * cells / power.shape[-1]), _LARGEST_SHARE)
    return np.asarray(1.0 / (1.0 - reliefs * share))
