"""The genie: an oracle detector, whose accuracy no detector of the same recordings can exceed by much.

In information theory a genie-aided receiver is given side information that a real one does not have. Here that is
everything except the symbol in question: the plant with its delay and lag, which axis moves what and by how much, the
statistics of the interference (fitted to recordings without a message, which are not measured on), and the symbols of
all other windows. It then compares the likelihoods of the M candidates. This word is used in code, tables and
documents in this sense alone; `hil.experiments.worlds.genie` is the same for worlds whose plant has no formula and is
fitted instead.

A recording is divided into uniform time bins of the detectors' `Motion`.
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
_NEGLIGIBLE = 1e-4


@dataclass(frozen=True)
class Interference:
    """`filter` (order + 1,): whitening filter, first coefficient 1; `scales` (axes,): the innovations' scales, m/s."""

    filter: Floats
    scales: Floats


def fit_interference(silences: Sequence[Motion]) -> Interference:
    """The interference's statistics, fitted to many motions without a message."""
    noise = fit_noise([motion.velocities for motion in silences], [motion.seen for motion in silences], ORDER)
    return Interference(noise.filters[0][0], np.sqrt(np.mean(np.square(noise.scales), axis=0)))


def tick_responses(plant: MecanumParameters, onset_s: float, rate_hz: float, ticks: int, motion: Motion) -> Floats:
    """(bins, ticks): mean velocity, m/s, in each time bin of `motion` for a command of 1 m/s held over one tick."""
    edges_s = motion.start_s + np.arange(len(motion.seen) + 1) * motion.step_s
    since_s = edges_s[:, None] - (onset_s + np.arange(ticks) / rate_hz)
    moved_m = step_displacement_m(plant, since_s) - step_displacement_m(plant, since_s - 1.0 / rate_hz)
    responses: Floats = np.diff(moved_m, axis=0) / motion.step_s
    return responses


def step_displacement_m(plant: MecanumParameters, since_s: Floats) -> Floats:
    """Displacement, m, of the chassis `since_s` after a command of 1 m/s from rest."""
    # The motion controller hands a command on one period after it came; the physics takes each step at the velocity
    # of the step's end.
    driven_s = np.maximum(0.0, since_s - SAMPLE_PERIOD_S - plant.delay_s + 0.5 * plant.step_s)
    return np.asarray(driven_s - plant.lag_s * -np.expm1(-driven_s / plant.lag_s))


def expected_motion(responses: Floats, samples: Floats, sigma: float) -> Floats:
    """(..., bins): velocity, m/s, that unit-variance waveforms (..., ticks) add to the motion."""
    return np.asarray(sigma * samples @ responses.T)


def responding_bins(responses: Floats) -> slice:
    """The time bins in which whitened candidates differ: those that respond, and `ORDER` on either side."""
    strongest = np.max(np.abs(responses), axis=1)
    bins = np.flatnonzero(strongest > _NEGLIGIBLE * strongest.max())
    return slice(max(0, int(bins[0]) - ORDER), int(bins[-1]) + ORDER + 1)


def log_likelihoods(residual: Floats, candidates: Floats, interference: Interference) -> Floats:
    """(M,): log-likelihood, nats, of each candidate up to a common constant.

    `residual` (axes, n) is the motion without every other window's noise, `candidates` (M, axes, n) what each symbol
    would add, both m/s. Innovations follow Student's t, since turns of the task are outliers: with a Gaussian law more
    symbols are wrong.
    """
    errors = whitened(residual - candidates, interference.filter) / interference.scales[:, None]
    total: Floats = -0.5 * (_DEGREES_OF_FREEDOM + 1.0) * np.sum(np.log1p(errors**2 / _DEGREES_OF_FREEDOM), axis=(1, 2))
    return total
