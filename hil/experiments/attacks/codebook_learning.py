"""A codebook averaged from filmed messages, told which symbol each said, and played on another body.

Each overheard rollout says each symbol once. The eavesdropper keeps the watermark's band of the agent's velocity,
averages a symbol's windows, and plays the mean as loud as the noise was. Under the fixed schedule windows come again
and the mean draws near the waveform; under the rolling one none does. The level is how many windows of each symbol were
overheard. Rollouts of one measurement share the key and what was learnt of it.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy import signal

from hil.experiments.attacks.attack import Attack
from hil.experiments.attacks.driving import (
    CHANCE_PERCENT,
    POINT,
    SCHEME,
    SIGMA_MPS,
    drive,
    goals_of,
    noise_of,
    observed_m,
    read_all,
    untouched,
)
from hil.experiments.runs.cells import Scalar
from hil.worlds.world import Integers
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Codebook

FIXED, ROLLING = "fixed schedule", "rolling schedule"
_LEVELS = (1.0, 2.0, 4.0, 8.0, 16.0)
_STREAM = 21
# The forger plays in a slot of its own, after all that was overheard.
_SLOT = 1000


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    secret = np.random.default_rng([_STREAM, seed]).bytes(32)
    scheme = replace(SCHEME, schedule="fixed" if arm == FIXED else "rolling")
    learnt = learnt_codebook([Codebook(secret, scheme, slot) for slot in range(round(level))], seed)
    seeds = range(seed, seed + rollouts)
    goals = np.array([goals_of(own) for own in seeds])
    noise = learnt[goals].reshape(rollouts, -1, 2)
    book = Codebook(secret, scheme, _SLOT)
    return read_all([book] * rollouts, drive(goals, noise, seeds, untouched), goals, seeds)


def learnt_codebook(books: list[Codebook], seed: int) -> Floats:
    """(M, ticks, 2): each symbol's mean window over films of one rollout for each of `books`, m/s."""
    seeds = range(seed + 500_000, seed + 500_000 + len(books))
    goals = np.array([goals_of(own) for own in seeds])
    noise = np.stack([noise_of(book, own) for book, own in zip(books, goals, strict=True)])
    driven = drive(goals, noise, seeds, untouched)
    positions_m = np.stack([observed_m(rollout, own) for rollout, own in zip(driven, seeds, strict=True)])
    return mean_windows(np.diff(positions_m, axis=1), goals)


def mean_windows(velocities: Floats, goals: Integers) -> Floats:
    """(M, ticks, 2): the mean over rollouts of what each symbol's window of `velocities` holds in the band."""
    sections = signal.butter(4, SCHEME.band_hz, "bandpass", fs=SCHEME.rate_hz, output="sos")
    # Forwards and backwards, so that nothing is shifted.
    in_band = signal.sosfiltfilt(sections, velocities, axis=1)
    windows = in_band.reshape(len(goals), POINT.goals, POINT.goal_ticks, 2)
    ordered = np.stack([own[np.argsort(order)] for own, order in zip(windows, goals, strict=True)])
    mean = ordered.mean(axis=0)
    loudness = np.sqrt(np.mean(mean**2, axis=(1, 2), keepdims=True))
    return np.asarray(mean * SIGMA_MPS / np.maximum(loudness, 1e-12))


ATTACK = Attack(
    name="codebook_learning", level="windows of each symbol overheard", counted="forged symbols read as meant",
    levels=dict.fromkeys((FIXED, ROLLING), _LEVELS), measure=_measure, chance_percent=CHANCE_PERCENT, share=0.4,
    batch=5,
)  # fmt: skip
