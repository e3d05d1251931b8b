"""The limit for any detector: one that is told everything but the symbol in question.

It knows the plant to the last millisecond, which axis moves what and how strongly, the statistics of the interference
(fitted on many recordings without a message), and what every other window carries.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil.fleet.rig import SAMPLE_PERIOD_S
from hil.plants.mecanum import MecanumParameters
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.noise import fit_noise, whitened
from mtm_audit.model.track import Floats

ORDER = 8
_DEGREES_OF_FREEDOM = 5.0
_INAUDIBLE = 1e-4


@dataclass(frozen=True)
class Interference:
    """`filter` (order + 1,): whitening filter, first coefficient 1; `scales` (axes,): of the innovations."""

    filter: Floats
    scales: Floats


def fit_interference(silences: Sequence[Motion]) -> Interference:
    """Fit motion without a message, many recordings at once."""
    noise = fit_noise([motion.velocities for motion in silences], [motion.seen for motion in silences], ORDER)
    return Interference(noise.filter, np.sqrt(np.mean(np.square(noise.scales), axis=0)))


def tick_responses(plant: MecanumParameters, onset_s: float, rate_hz: float, ticks: int, motion: Motion) -> Floats:
    """Mean velocity in each cell of `motion` for a command of 1 m/s held over one tick: (cells, ticks)."""
    edges_s = motion.start_s + np.arange(len(motion.seen) + 1) * motion.step_s
    since_s = edges_s[:, None] - (onset_s + np.arange(ticks) / rate_hz)
    moved_m = _step_displacement_m(plant, since_s) - _step_displacement_m(plant, since_s - 1.0 / rate_hz)
    responses: Floats = np.diff(moved_m, axis=0) / motion.step_s
    return responses


def _step_displacement_m(plant: MecanumParameters, since_s: Floats) -> Floats:
    """How far the chassis has come `since_s` after a command of 1 m/s from rest."""
    # The motion controller hands a command on one period after it came; the physics takes each step at the velocity
    # of the step's end.
    driven_s = np.maximum(0.0, since_s - SAMPLE_PERIOD_S - plant.delay_s + 0.5 * plant.step_s)
    return np.asarray(driven_s - plant.lag_s * -np.expm1(-driven_s / plant.lag_s))


def expected_motion(responses: Floats, samples: Floats, sigma: float) -> Floats:
    """What waveforms (..., ticks) of unit variance add to the motion: (..., cells)."""
    return np.asarray(sigma * samples @ responses.T)


def heard_cells(responses: Floats) -> slice:
    """The cells in which whitened candidates can differ: those that hear the window, and the filter's order around."""
    loudest = np.max(np.abs(responses), axis=1)
    heard = np.flatnonzero(loudest > _INAUDIBLE * loudest.max())
    return slice(max(0, int(heard[0]) - ORDER), int(heard[-1]) + ORDER + 1)


def log_likelihoods(residual: Floats, candidates: Floats, interference: Interference) -> Floats:
    """Of each candidate, up to a common constant: `residual` (axes, n), `candidates` (M, axes, n), to (M,).

    The innovations follow Student's t: turns are outliers, and a Gaussian law has more symbols wrong.
    """
    errors = whitened(residual - candidates, interference.filter) / interference.scales[:, None]
    total: Floats = -0.5 * (_DEGREES_OF_FREEDOM + 1.0) * np.sum(np.log1p(errors**2 / _DEGREES_OF_FREEDOM), axis=(1, 2))
    return total
