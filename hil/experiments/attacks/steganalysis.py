"""Steganalysis: is there noise in this motion, and is it keyed? By somebody without the key, from filmed motion.

A linear discriminant on the logarithms of the velocity's power in eight bands of each axis is trained on half of the
rollouts, labelled, and ranks the others. Each trial is a pair, one rollout with a message and one of the arm without;
right is when the one with the message ranks higher. The share of these is the area under the ROC curve (AUC), and pairs
have no rollout in common, so that its interval is exact. The level is how long the film is.
"""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from hil.experiments.attacks.attack import RIGHT, TRIALS, Attack
from hil.experiments.attacks.driving import SIGMA_MPS, TICKS, band_noise, drive, goals_of, observed_m, untouched
from hil.experiments.runs.cells import Scalar
from mtm_audit.model.track import Floats

DISCRIMINANT = "discriminant"
CLEAN, WHITE, SAME_BAND = "against no noise", "against white noise", "against noise of the same band"
_LEVELS = (6.0, 12.0, 24.0, 48.0, 96.0)
_RATE_HZ, _BANDS = 10.0, 8
_STREAM = 23
_RIDGE = 1e-3


def band_powers(velocities: Floats) -> Floats:
    """(rollouts, 16): log mean power in eight equal bands of each axis of velocities (rollouts, ticks, 2)."""
    windowed = velocities * np.hanning(velocities.shape[1])[:, None]
    power = np.abs(np.fft.rfft(windowed, axis=1)[:, 1:]) ** 2
    bands = [np.log(part.mean(axis=1) + 1e-15) for part in np.array_split(power, _BANDS, axis=1)]
    return np.concatenate(bands, axis=1)


def ranked_higher(with_message: Floats, without: Floats) -> tuple[int, int]:
    """Pairs of the second halves of two sets of features, and in how many of them the first ranks higher."""
    half = len(with_message) // 2
    classes = with_message[:half], without[:half]
    within = np.sum([np.cov(part, rowvar=False) for part in classes], axis=0)
    spread = within + _RIDGE * np.trace(within) / len(within) * np.eye(len(within))
    direction = np.linalg.solve(spread, classes[0].mean(axis=0) - classes[1].mean(axis=0))
    ranks = with_message[half:] @ direction > without[half:] @ direction
    return len(ranks), int(ranks.sum())


@lru_cache(maxsize=4)
def _velocities(kind: str, rollouts: int, seed: int) -> Floats:
    """(rollouts, ticks, 2): filmed velocities of rollouts of their own, with a message when `kind` is empty."""
    kinds = ("", CLEAN, WHITE, SAME_BAND)
    draw = np.random.default_rng([_STREAM, kinds.index(kind), seed])
    shape = rollouts, TICKS, 2
    # A message differs from noise of its band in nothing but the key, and each rollout has a key of its own.
    if kind == CLEAN:
        noise: Floats = np.zeros(shape)
    elif kind == WHITE:
        noise = SIGMA_MPS * draw.standard_normal(shape)
    else:
        noise = band_noise(shape, draw)
    seeds = range(first := seed + 10_000 * kinds.index(kind), first + rollouts)
    goals = np.array([goals_of(own) for own in seeds])
    driven = drive(goals, noise, seeds, untouched)
    positions_m = np.stack([observed_m(rollout, own) for rollout, own in zip(driven, seeds, strict=True)])
    return np.asarray(np.diff(positions_m, axis=1) * _RATE_HZ)


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    ticks = round(level * _RATE_HZ)
    features = [band_powers(_velocities(kind, rollouts, seed)[:, :ticks]) for kind in ("", arm)]
    pairs, higher = ranked_higher(*features)
    return {f"{DISCRIMINANT} {TRIALS}": pairs, f"{DISCRIMINANT} {RIGHT}": higher}


ATTACK = Attack(
    name="steganalysis", level="length of the film, s", counted="pairs ranked rightly (AUC)",
    levels=dict.fromkeys((CLEAN, WHITE, SAME_BAND), _LEVELS), measure=_measure, chance_percent=50.0, share=8.0,
    batch=400,
)  # fmt: skip
