"""Discovery under somebody between its computer and its motors: what both detectors then read, and what it costs.

The paper's setting (appendix "Adversarial Robustness"): M = 8, T = 120, eight goals a rollout, each a message of one
symbol on both axes, keys and starts of their own in each rollout. The agent is observed as the paper's camera and
tracker observe it: at its true position, with that tracker's error.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import numpy as np

from hil.experiments.attacks.attack import DISTANCE, DISTORTION, MARGIN, RIGHT, TRIALS
from hil.experiments.runs.cells import Scalar
from hil.experiments.worlds.points import headline_point
from hil.experiments.worlds.reading import COHERENCY, MATCHED, ObservedShot, read_windows
from hil.worlds.discovery import GOAL_LOCATIONS_M, GOALS, Discovery, Tamper, Tick
from hil.worlds.noise import keyed_noise
from hil.worlds.world import Integers, Rollout
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.track import Floats, Track
from mtm_onboard.protocol import Codebook, Scheme

READERS = (COHERENCY, MATCHED)
POINT = headline_point("discovery", 120)
SCHEME = POINT.scheme
SIGMA_MPS = SCHEME.channels[0].sigmas[0]
TICKS = POINT.goals * POINT.goal_ticks
CHANCE_PERCENT = 100.0 / POINT.alphabet_size
# What the tracker of the paper's pictures of 704 pixels is off by, measured on a rollout: 0.23 pixels of 1/352 m.
TRACKER_ERROR_M = 0.23 / 352.0
_KEYS_STREAM, _GOALS_STREAM, _TRACKER_STREAM = 11, 12, 13
# Rollouts that an attacker learns from; their seeds are far from all that are measured.
_LEARNING, _LEARNING_SEED = 25, 90_000

# What is injected in the place of the keyed noise alone (rollouts, ticks, 2).
Injected = Callable[[Floats, np.random.Generator], Floats]


def goals_of(seed: int) -> Integers:
    """The goals of a rollout in order, which are its messages as well."""
    return np.random.default_rng([_GOALS_STREAM, seed]).permutation(GOALS)


def codebook_of(seed: int, scheme: Scheme = SCHEME) -> Codebook:
    """A rollout's codebook."""
    return Codebook(np.random.default_rng([_KEYS_STREAM, seed]).bytes(32), scheme)


def noise_of(codebook: Codebook, goals: Integers) -> Floats:
    """(ticks, 2): the keyed noise that says the goals, m/s."""
    return keyed_noise(codebook, [(int(goal),) for goal in goals], Discovery.axes)


def drive(goals: Integers, noise: Floats, seeds: Sequence[int], tamper: Tamper) -> list[Rollout]:
    """Rollouts under noise (rollouts, ticks, 2) and the tampering."""
    shape = len(seeds), POINT.goals, POINT.goal_ticks, 2
    return Discovery().run_tampered(goals, noise.reshape(shape), seeds, tamper)


def untouched(tick: Tick) -> Floats:
    """Nobody tampers."""
    return tick.requested_mps


def observed_m(rollout: Rollout, seed: int) -> Floats:
    """(ticks + 1, 2): the agent's positions as the tracker finds them in the pictures."""
    draw = np.random.default_rng([_TRACKER_STREAM, seed])
    states_m = rollout.shots[0].states
    return np.asarray(states_m + TRACKER_ERROR_M * draw.standard_normal(states_m.shape))


def scores_of(codebook: Codebook, rollout: Rollout, seed: int, reader: str, delays: Floats | None = None) -> Floats:
    """(goals, M): how well each candidate fits each goal's window; `delays` as `read_windows` takes them."""
    times_s = rollout.shots[0].times_s
    track = Track("agent", times_s, observed_m(rollout, seed), np.ones(len(times_s), dtype=np.bool_))
    seen = ObservedShot(float(times_s[0]), range(len(times_s) - 1), {"agent": glimpse_of_track(track)})
    return read_windows(codebook, [seen], POINT.goals, reader, delays)[0]


def suppressed(
    tamper: Callable[[int, np.random.Generator], Tamper],
    rollouts: int,
    seed: int,
    injected: Injected | None = None,
    scheme: Scheme = SCHEME,
    told: Mapping[str, Floats] | None = None,
) -> dict[str, Scalar]:
    """What is left of the messages when the tampering of so many rollouts is made by `tamper(rollouts, draw)`.

    `told` has delays as `read_windows` takes them, with which the matched detector reads once more, by what it is told.
    """
    seeds = range(seed, seed + rollouts)
    draw = np.random.default_rng([_KEYS_STREAM, _GOALS_STREAM, seed])
    goals, books = np.array([goals_of(own) for own in seeds]), [codebook_of(own, scheme) for own in seeds]
    noise = np.stack([noise_of(book, own) for book, own in zip(books, goals, strict=True)])
    if injected is not None:
        noise = injected(noise, draw)
    driven = drive(goals, noise, seeds, tamper(rollouts, draw))
    found = {**read_all(books, driven, goals, seeds), **costs(driven, goals)}
    for what, delays in (told or {}).items():
        scores = [scores_of(*each, MATCHED, delays) for each in zip(books, driven, seeds, strict=True)]
        found |= _counted(f"{MATCHED}, told {what}", scores, goals)
    return found


def read_all(
    books: Sequence[Codebook], driven: Sequence[Rollout], goals: Integers, seeds: Sequence[int]
) -> dict[str, Scalar]:
    """Messages tried and right and the mean margin between the best candidate and the next, for each reader."""
    result: dict[str, Scalar] = {}
    for reader in READERS:
        result |= _counted(reader, [scores_of(*each, reader) for each in zip(books, driven, seeds, strict=True)], goals)
    return result


def _counted(reader: str, scores: Sequence[Floats], goals: Integers) -> dict[str, Scalar]:
    best = np.sort(np.concatenate(scores), axis=1)
    return {
        f"{reader} {TRIALS}": goals.size,
        f"{reader} {RIGHT}": int(np.sum(np.argmax(np.concatenate(scores), axis=1) == goals.ravel())),
        f"{reader} {MARGIN}": float(np.mean(best[:, -1] - best[:, -2])),
    }


def costs(driven: Sequence[Rollout], goals: Integers) -> dict[str, Scalar]:
    """How far the tampering changed the commands, relative to them, and the mean distance from the goal."""
    applied = np.stack([rollout.control.applied for rollout in driven])
    requested = np.stack([rollout.control.requested for rollout in driven])
    pursued_m = np.repeat(GOAL_LOCATIONS_M[goals], POINT.goal_ticks, axis=1)
    positions_m = np.stack([rollout.shots[0].states[1:] for rollout in driven])
    return {
        DISTORTION: float(np.sqrt(np.mean((applied - requested) ** 2) / np.mean(requested**2))),
        DISTANCE: float(np.mean(np.linalg.norm(positions_m - pursued_m, axis=2))),
    }


@lru_cache(maxsize=4)
def overheard(scheme: Scheme = SCHEME) -> tuple[Floats, Floats, Floats]:
    """Noise, exact positions before each tick and observed ones, (rollouts, ticks, 2), of rollouts to learn from."""
    seeds = range(_LEARNING_SEED, _LEARNING_SEED + _LEARNING)
    goals = np.array([goals_of(own) for own in seeds])
    noise = np.stack([noise_of(codebook_of(own, scheme), each) for own, each in zip(seeds, goals, strict=True)])
    driven = drive(goals, noise, seeds, untouched)
    exact_m = np.stack([rollout.shots[0].states[:-1] for rollout in driven])
    filmed_m = np.stack([observed_m(rollout, own)[:-1] for rollout, own in zip(driven, seeds, strict=True)])
    return noise, exact_m, filmed_m


def band_noise(shape: tuple[int, int, int], draw: np.random.Generator) -> Floats:
    """(rollouts, ticks, 2): noise of the keyed noise's band and strength under fresh keys, m/s."""
    symbols = draw.integers(0, SCHEME.alphabet_size, (shape[0], shape[1] // SCHEME.message_ticks))
    return np.stack([noise_of(Codebook(draw.bytes(32), SCHEME), own) for own in symbols])
