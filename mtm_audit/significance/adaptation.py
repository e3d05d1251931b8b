"""A hypothesis that learns: each tone's response and interference as other positions of the message show them.

No family of plants holds every robot, and interference is fitted to motion that holds the message. Once other positions
are read, the recording shows how each tone comes through, whatever the robot is: a complex gain a tone, relative to the
hypothesis' plant, and how large what remains is. Both follow from the recording and from the waveforms of those other
positions alone, and so a candidate weighed with them is an e-value as before.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.track import Floats

Complexes = NDArray[np.complex128]

# Prior precision of a tone's gain around that of the plant, and of the remaining power around 1, in observations.
_GAIN_PRECISION = 4.0
_POWER_PRIOR = 4.0
# Remaining power is shared by neighbouring tones.
_NEIGHBOURS = np.array([0.5, 1.0, 0.5])
_LEAST_QUADRATIC = 1e-9


@dataclass(frozen=True)
class Seen:
    """What each group of windows shows of each tone under each hypothesis, real and imaginary part as one number.

    `linear` and `quadratic` (hypotheses, groups, axes, K) as in a log-likelihood ratio Re(conj(t) linear)
    - quadratic |t|^2 / 2 of a waveform's tones t.
    """

    linear: Complexes
    quadratic: Floats


def seen_of(linear: Floats, quadratic: Floats) -> Seen:
    """From weights (hypotheses, groups, axes, 2 K), real parts first."""
    count = linear.shape[-1] // 2
    return Seen(linear[..., :count] + 1j * linear[..., count:], quadratic[..., :count])


def adapted(seen: Seen, sent: Floats, used: NDArray[np.bool_], targets: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Weights of the groups `targets` once each has learned from the groups that are `used` (targets, groups) for it.

    `sent` (groups, axes, 2 K) are the tones of what each group is taken to have sent. Returns (hypotheses, targets,
    axes, 2 K) each; a target that learns from nothing keeps its weights.
    """
    count = sent.shape[-1] // 2
    tones = sent[..., :count] + 1j * sent[..., count:]
    power = seen.quadratic * np.abs(tones) ** 2
    learned = used.astype(np.float64)
    crossed = np.einsum("tg,hgak->htak", learned, np.conj(tones) * seen.linear)
    information = np.einsum("tg,hgak->htak", learned, power)
    spent = np.einsum("tg,hgak->htak", learned, np.abs(seen.linear) ** 2 / np.maximum(seen.quadratic, _LEAST_QUADRATIC))
    shown = np.einsum("tg,hgak->htak", learned, 1.0 * (seen.quadratic > _LEAST_QUADRATIC))
    precision = information + _GAIN_PRECISION
    gains = (crossed + _GAIN_PRECISION) / precision
    left = spent - 2.0 * (np.conj(gains) * crossed).real + np.abs(gains) ** 2 * information
    freedom = 2.0 * (shown - information / precision)
    remaining = (_over_tones(np.maximum(left, 0.0)) + _POWER_PRIOR) / (_over_tones(freedom) + _POWER_PRIOR)
    # A gain that is known badly is one more interference: tones have a mean power of 2 / K.
    quadratic = seen.quadratic[:, targets]
    remaining = remaining + quadratic * (2.0 / count) / precision
    keeps = ~used.any(axis=1)
    remaining[:, keeps], gains[:, keeps] = 1.0, 1.0
    linear = np.conj(gains) * seen.linear[:, targets] / remaining
    quadratic = quadratic * np.abs(gains) ** 2 / remaining
    return np.concatenate([linear.real, linear.imag], axis=-1), np.concatenate([quadratic, quadratic], axis=-1)


def _over_tones(values: Floats) -> Floats:
    """Each tone's value with a share of its neighbours', (..., K), all axes together."""
    total = values.sum(axis=-2, keepdims=True)
    padded = np.pad(total, [(0, 0)] * (total.ndim - 1) + [(1, 1)])
    summed = sum(share * padded[..., place : place + total.shape[-1]] for place, share in enumerate(_NEIGHBOURS))
    return np.asarray(np.broadcast_to(summed, values.shape))
