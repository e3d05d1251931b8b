"""Log e-values of candidates under hypotheses of timing, plant and gain.

A hypothesis gives a function f of a candidate's tones t, the likelihood ratio exp(u . t - sum q t^2 / 2) of the motion
with the candidate against the motion without it. u and q follow from the recording and the hypothesis alone. If the key
had no part in the motion, t is drawn by the key stream's own law whatever the recording holds, so that f divided by its
mean over that law (`normaliser`) has mean 1 over keys: it is an e-value.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.projections import Projections
from mtm_audit.model.track import Floats
from mtm_audit.significance.gains import Levels, precision_factors
from mtm_audit.significance.normaliser import log_mean_normal, log_mean_sphere
from mtm_onboard.protocol.scheme import Power

Integers = NDArray[np.int64]
_MOST_TOGETHER = 1 << 21


@dataclass(frozen=True)
class Hypotheses:
    """Where in a table hypotheses stand: numbers of `timings`, `plants`, `levels` and `turns`, each (hypotheses,)."""

    timings: Integers
    plants: Integers
    levels: Integers
    turns: Integers


def approximate_log_e(
    projections: Projections,
    tones: Floats,
    levels: Levels,
    turns: Floats,
    timings: Integers,
    plants: Integers,
    by_position: Callable[[Floats], Floats],
    precision: type[np.floating[Any]] = np.float64,
) -> Floats:
    """Log e-values of pairs of a timing and a plant: (pairs, levels, orientations, positions, candidates).

    `tones` (groups, candidates, injected axes, 2 K); `timings` and `plants` (pairs,); `by_position` adds up the groups
    of a position, some pairs after the others, since a table of all groups is large; `precision` is the
    result's. With observed axes that leave each other's precision alone and tones taken to be normal: to choose
    hypotheses and to weigh them, never as evidence.
    """
    groups, candidates = tones.shape[:2]
    each = len(levels.magnitudes) * len(turns) * groups * candidates
    step = max(1, _MOST_TOGETHER // each)
    result = np.empty(0)
    for at in range(0, len(timings), step):
        some = slice(at, at + step)
        table = by_position(_approximate(projections, tones, levels, turns, timings[some], plants[some]))
        if at == 0:
            result = np.empty((len(timings), *table.shape[1:]), dtype=precision)
        result[some] = table
    return result


def _approximate(
    projections: Projections, tones: Floats, levels: Levels, turns: Floats, timings: Integers, plants: Integers
) -> Floats:
    power, seen = projections.power[plants], projections.seen[timings]
    count = power.shape[-1]
    factors = precision_factors(levels, power.mean(axis=1), projections.cells)
    magnitudes = levels.magnitudes[:, None, None, None]
    unit = 0.5 * magnitudes**2 * factors[:, :, None] * power
    quadratic = unit[:, :, None] * seen[..., None]
    weighted = magnitudes[..., None] * np.tile(factors, 2)[:, :, None, None] * projections.linear[timings, plants]
    found = np.einsum("lpgok,gcak->lpoagc", weighted, tones, optimize=True)
    squares = tones[..., :count] ** 2 + tones[..., count:] ** 2
    spent = np.einsum("lpok,gcak->lpoagc", unit, squares, optimize=True)
    spent *= seen.transpose(0, 2, 1)[:, :, None, :, None]
    # Real and imaginary parts have one weight.
    spent -= 2.0 * np.log1p(quadratic / count).sum(axis=-1).transpose(0, 1, 3, 2)[:, :, :, None, :, None]
    scaled = weighted / np.sqrt(count + np.tile(quadratic, 2))
    moments = np.einsum("lpgok,lpgqk->lpoqg", scaled, scaled, optimize=True)
    return _turned(turns, found, spent, moments)


def _turned(turns: Floats, found: Floats, spent: Floats, moments: Floats) -> Floats:
    """Values (pairs, levels, orientations, groups, candidates) of every orientation: one product with all that depends
    on none, `found` and `spent` (levels, pairs, observed axes, injected axes, groups, candidates), `moments` (levels,
    pairs, observed axes, observed axes, groups).
    """
    levels, pairs, *_, groups, candidates = found.shape
    crossed = np.einsum("roa,rqa->roq", turns, turns)
    rows = [part.reshape(len(turns), -1) for part in (turns, -0.5 * turns**2, -0.5 * crossed)]
    spread = np.broadcast_to(moments[..., None], (*moments.shape, candidates))
    columns = [part.reshape(levels, pairs, -1, groups * candidates) for part in (found, spent, spread)]
    table = np.concatenate(rows, axis=1) @ np.concatenate(columns, axis=2)
    return np.asarray(table.reshape(levels, pairs, len(turns), groups, candidates).swapaxes(0, 1))


def log_e(
    projections: Projections, tones: Floats, levels: Levels, turns: Floats, chosen: Hypotheses, law: Power
) -> Floats:
    """Exact log e-values under chosen hypotheses: (hypotheses, groups, candidates)."""
    linear, quadratic = weights(projections, levels, turns, chosen)
    return log_e_of(linear, quadratic, tones, law)


def log_e_of(linear: Floats, quadratic: Floats, tones: Floats, law: Power) -> Floats:
    """Log e-values of `tones` (groups, candidates, axes, 2 K) under weights (hypotheses, groups, axes, 2 K)."""
    log_mean = log_mean_normal if law == "ensemble" else log_mean_sphere
    found = np.einsum("hgak,gcak->hgc", linear, tones, optimize=True)
    found -= 0.5 * np.einsum("hgak,gcak->hgc", quadratic, tones**2, optimize=True)
    return np.asarray(found - log_mean(linear, quadratic).sum(axis=-1)[..., None])


def weights(projections: Projections, levels: Levels, turns: Floats, chosen: Hypotheses) -> tuple[Floats, Floats]:
    """U and q of each hypothesis, group and injected axis: (hypotheses, groups, axes, 2 K) each."""
    power = projections.power[chosen.plants]
    magnitudes, reliefs = levels.magnitudes[chosen.levels], levels.reliefs[chosen.levels]
    mean_power = projections.power.mean(axis=1)
    share = precision_factors(Levels(magnitudes, reliefs, magnitudes), mean_power, projections.cells)
    factors = np.tile(share[np.arange(len(magnitudes)), chosen.plants], 2)
    gains = magnitudes[:, None, None] * turns[chosen.turns]
    linear = np.einsum("hoa,hgok->hgak", gains, projections.linear[chosen.timings, chosen.plants], optimize=True)
    spread = 0.5 * factors[:, None] * np.tile(power, 2)
    quadratic = np.einsum("hoa,hgo,hok->hgak", gains**2, projections.seen[chosen.timings], spread, optimize=True)
    return linear * factors[:, None, None], quadratic
