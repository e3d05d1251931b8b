"""Whitened motion correlated with every tone at the timings and plants near a found one: what evidence is made of.

Nothing here depends on the key beyond its scheme: the recording and the place where to look settle all of it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.correlate import Prepared
from mtm_audit.detectors.matched.noise import power_response
from mtm_audit.detectors.matched.plants import MEMORY_S, TAIL_S, Plants, tone_responses
from mtm_audit.model.track import Floats


@dataclass(frozen=True)
class Places:
    """Where to look: `starts_s` (timings, windows) when each window begins, and `plants` after the delay it holds.

    `groups` (windows,) numbers the windows that are played from one waveform.
    """

    starts_s: Floats
    groups: NDArray[np.int64]
    plants: Plants
    length_s: float
    tones_hz: Floats


@dataclass(frozen=True)
class Projections:
    """A body's motion projected on the tones, in units of its interference.

    One unit for all axes, since a camera turns axes into each other whose interference differs. `linear` (timings,
    plants, groups, observed axes, 2 K): correlations with unit tones, real parts first; `seen` (timings, groups,
    observed axes): how many cells count; `power` (plants, observed axes, K): of a unit tone's whitened response in a
    cell; `cells`: how many a window has.
    """

    linear: Floats
    seen: Floats
    power: Floats
    cells: float


def project(prepared: Prepared, places: Places) -> Projections:
    """Correlate with each plant's response to each tone, at each timing."""
    motion = prepared.motion
    step_s, count = motion.step_s, len(motion.seen)
    lasting = int(np.ceil((places.length_s + TAIL_S) / step_s))
    middles_s = (np.arange(lasting) + 0.5) * step_s
    responses = tone_responses(places.plants, places.tones_hz, middles_s, places.length_s)
    relative = _relative_precision(prepared.scales)
    lags = (places.starts_s - motion.start_s) / step_s
    whole = np.rint(lags).astype(np.int64)
    padded = np.pad(prepared.filtered, ((0, 0), (lasting, lasting)))
    weights = np.pad(prepared.weights, ((0, 0), (lasting, lasting)))
    first = np.clip(whole + lasting, 0, count + lasting)
    index = first[..., None] + np.arange(lasting)
    heard = np.einsum("otwn,pkn->tpwok", padded[:, index], responses, optimize=True)
    turn = np.exp(-2j * np.pi * places.tones_hz * ((lags - whole) * step_s)[..., None])
    heard *= turn[:, None, :, None, :]
    within = places.length_s / step_s / lasting
    seen = weights[:, index].sum(axis=-1).transpose(1, 2, 0) * within
    number = int(places.groups.max()) + 1
    linear = np.zeros((len(lags), len(responses), number, len(padded), 2 * len(places.tones_hz)))
    counted = np.zeros((len(lags), number, len(padded)))
    for window, group in enumerate(places.groups):
        whole_tones = np.concatenate([heard[:, :, window].real, heard[:, :, window].imag], axis=-1)
        linear[:, :, group] += whole_tones * relative[:, None]
        counted[:, group] += seen[:, window]
    settled = tone_responses(places.plants, places.tones_hz, np.array([MEMORY_S]), 2.0 * MEMORY_S)[:, :, 0]
    filtered = power_response(prepared.noise_filters, places.tones_hz * step_s) * relative[:, None] ** 2
    return Projections(linear, counted, np.abs(settled[:, None]) ** 2 * filtered, places.length_s / step_s)


def shaped(projections: Projections, powers: Floats) -> Projections:
    """What tones of those mean `powers` (K,), in units of their spread, show: as of tones that are alike loud."""
    spreads = np.sqrt(np.concatenate([powers, powers]))
    return replace(projections, linear=projections.linear * spreads, power=projections.power * powers)


def _relative_precision(scales: Floats) -> Floats:
    """How quiet each axis is beside all of them together (axes,); 1 where all are alike."""
    precisions = 1.0 / np.maximum(scales, 1e-12 * max(float(scales.max()), 1e-300))
    return np.asarray(precisions / np.sqrt(np.mean(precisions**2)))
