"""A codebook averaged from filmed messages, told which symbol each said, and played on another body.

Each overheard rollout says each symbol once. The eavesdropper keeps the watermark's band of the agent's velocity,
averages a symbol's windows, and plays the mean as loud as the noise was. Under the fixed schedule windows come again
and the mean draws near the waveform; under the rolling one none does. The level is how many windows of each symbol were
overheard. Rollouts of one measurement share the key and what was learnt of it.

As a hardening of the fixed schedule, a slot may give the symbols another order, which the key says: symbol i is then
played as the waveform of number order[i]. This eavesdropper tells waveforms apart by their likeness instead, and takes
the order of the first slot that was overheard.
What is forged is counted twice: when it reads as it was meant, and when it reads as any waveform that was learnt, which
is what shows that a message of the key is there. One order holds for all that is forged in one measurement, so that a
point's rate of the former kind swings with it.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy import signal
from scipy.optimize import linear_sum_assignment

from hil.experiments.attacks.attack import MARGIN, RIGHT, TRIALS, Attack
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
from hil.experiments.worlds.reading import MATCHED
from hil.worlds.world import Integers
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Codebook

FIXED, ROLLING = "fixed schedule", "rolling schedule"
PERMUTED = "fixed schedule, another order of symbols in each slot"
PRESENT = f"{MATCHED}, as the waveform that was learnt"
_LEVELS = (1.0, 2.0, 4.0, 8.0, 16.0)
_STREAM = 21
# The forger plays in a slot of its own, after all that was overheard.
_SLOT = 1000
_ORDERS = 1


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    secret = np.random.default_rng([_STREAM, seed]).bytes(32)
    scheme = replace(SCHEME, schedule="rolling" if arm == ROLLING else "fixed")
    books = [Codebook(secret, scheme, slot) for slot in range(round(level))]
    seeds = range(seed, seed + rollouts)
    meant = np.array([goals_of(own) for own in seeds])
    book = Codebook(secret, scheme, _SLOT)
    if arm != PERMUTED:
        learnt = learnt_codebook(books, seed)
        noise = learnt[meant].reshape(rollouts, -1, 2)
        return read_all([book] * rollouts, drive(meant, noise, seeds, untouched), meant, seeds)
    orders = np.random.default_rng([_STREAM, _ORDERS, seed]).permuted(
        np.tile(np.arange(scheme.alphabet_size), (len(books) + 1, 1)), axis=1
    )
    learnt = learnt_codebook(books, seed, orders[:-1])
    driven = drive(meant, learnt[meant].reshape(rollouts, -1, 2), seeds, untouched)
    # Waveforms are told by their numbers: what is meant by the first slot's order, and what it says in the last one.
    found = read_all([book] * rollouts, driven, orders[-1][meant], seeds)
    seen = read_all([book] * rollouts, driven, orders[0][meant], seeds)
    return found | {f"{PRESENT} {what}": seen[f"{MATCHED} {what}"] for what in (TRIALS, RIGHT, MARGIN)}


def learnt_codebook(books: list[Codebook], seed: int, orders: Integers | None = None) -> Floats:
    """(M, ticks, 2): each symbol's mean window over films of one rollout for each of `books`, m/s.

    With `orders` (books, M) symbol i of a book's slot is played as the waveform orders[slot, i], and windows are
    averaged that are alike.
    """
    seeds = range(seed + 500_000, seed + 500_000 + len(books))
    goals = np.array([goals_of(own) for own in seeds])
    played = goals if orders is None else np.take_along_axis(orders, goals, axis=1)
    noise = np.stack([noise_of(book, own) for book, own in zip(books, played, strict=True)])
    driven = drive(goals, noise, seeds, untouched)
    positions_m = np.stack([observed_m(rollout, own) for rollout, own in zip(driven, seeds, strict=True)])
    return mean_windows(np.diff(positions_m, axis=1), goals, by_likeness=orders is not None)


def mean_windows(velocities: Floats, goals: Integers, *, by_likeness: bool = False) -> Floats:
    """(M, ticks, 2): the mean over rollouts of what each symbol's window of `velocities` holds in the band.

    By likeness each rollout's windows are those of the first rollout's symbols that they resemble most, one for one.
    """
    sections = signal.butter(4, SCHEME.band_hz, "bandpass", fs=SCHEME.rate_hz, output="sos")
    # Forwards and backwards, so that nothing is shifted.
    in_band = signal.sosfiltfilt(sections, velocities, axis=1)
    windows = in_band.reshape(len(goals), POINT.goals, POINT.goal_ticks, 2)
    ordered = np.stack([own[np.argsort(order)] for own, order in zip(windows, goals, strict=True)])
    if by_likeness:
        likeness = np.einsum("mta,rnta->rmn", ordered[0], ordered)
        ordered = np.stack([own[linear_sum_assignment(-near)[1]] for own, near in zip(ordered, likeness, strict=True)])
    mean = ordered.mean(axis=0)
    loudness = np.sqrt(np.mean(mean**2, axis=(1, 2), keepdims=True))
    return np.asarray(mean * SIGMA_MPS / np.maximum(loudness, 1e-12))


ATTACK = Attack(
    name="codebook_learning", level="windows of each symbol overheard", counted="forged symbols read as meant",
    levels=dict.fromkeys((FIXED, ROLLING, PERMUTED), _LEVELS), measure=_measure, chance_percent=CHANCE_PERCENT,
    share=0.4, batch=5,
)  # fmt: skip
