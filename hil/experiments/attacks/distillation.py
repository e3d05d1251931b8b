"""A clone of the watermarked policy, learnt from what it observed and did, and whether its motion says the message.

The Reacher's policy, whose noise is the keyed one, says the same message over and over under the fixed schedule, which
is the most that a clone can learn from. Its observations and actions are recorded, and a network with a mean and a
spread of its own is fitted to them. Then the clone drives, and the arm's true angles are read with the key. The level
is how many steps were recorded. Each rollout has a key, a message and a clone of its own, and eight windows, each of
which is right when it reads as the message that was recorded.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from hil.experiments.attacks.attack import DISTANCE, FORETOLD, MARGIN, RIGHT, TRIALS, Attack
from hil.experiments.attacks.foretelling import share_foretold
from hil.experiments.attacks.network import RIDGES, Network
from hil.experiments.runs.cells import Scalar
from hil.experiments.worlds.points import headline_point
from hil.experiments.worlds.reading import COHERENCY, MATCHED, ObservedShot, read_windows
from hil.worlds.noise import keyed_noise
from hil.worlds.reacher import Policy, Reacher
from hil.worlds.reacher_policy import LOG_STD_BOUNDS, trained_policy
from hil.worlds.world import Rollout
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.track import Floats, Track
from mtm_onboard.protocol import Codebook

OWN_NOISE, MEAN_ALONE, TOLD_THE_TICK = "with noise of its own", "its mean alone", "told the message's tick"
POINT = headline_point("reacher")
TICKS = POINT.goals * POINT.goal_ticks
POLICY_ITSELF = f"{MATCHED}, the policy itself"
_LEVELS = (480.0, 1920.0, 7680.0, 30720.0)
_STREAM = 31
_TEACHING = 1_000_000
# With so many the policy's mean is met to 0.2 % of its variance, where its noise is left out.
_UNITS = 600
_ANGLE_ERROR_RAD = 1e-3
# Actions nearer to full torque are taken as this near, so that what was asked for stays finite.
_FULL = 1.0 - 1e-6
# The mean of the logarithm of a squared standard normal variable.
_LOG_SQUARE = -1.27


class Watched:
    """A policy whose observations (ticks, rollouts, 10) are kept."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self.observations: list[Floats] = []

    def distribution(self, observations: Floats) -> tuple[Floats, Floats]:
        """The policy's own."""
        self.observations.append(observations)
        return self._policy.distribution(observations)


class Clone:
    """A Gaussian policy fitted to observations (m, 10) and the actions (m, 2) that were taken at them.

    `ticks` (m,) are given to a clone that knows the tick of the message, and count from 0 when it drives. Without
    noise (`spread` False) it does what it thinks best.
    """

    def __init__(self, observations: Floats, actions: Floats, ticks: Sequence[int] | None, *, spread: bool) -> None:
        asked = np.arctanh(np.clip(actions, -_FULL, _FULL))
        self._told, self._spread, self._tick = ticks is not None, spread, 0
        when = None if ticks is None else _marked(ticks)
        self._mean = Network(observations, asked, when, units=_UNITS, gain=0.5, offsets=1.0, ridges=RIDGES)
        left = np.log((asked - self._mean(observations, when)) ** 2 + 1e-6)
        self._log_square = Network(observations, left, ridges=RIDGES)

    def distribution(self, observations: Floats) -> tuple[Floats, Floats]:
        """Means and standard deviations, (n, 2) each, before tanh."""
        when = _marked([self._tick] * len(observations)) if self._told else None
        self._tick += 1
        log_std = 0.5 * (self._log_square(observations) - _LOG_SQUARE)
        std = np.exp(np.clip(log_std, *LOG_STD_BOUNDS)) if self._spread else np.zeros_like(log_std)
        return self._mean(observations, when), std


def _marked(ticks: Sequence[int]) -> Floats:
    """(m, message ticks): a one at each row's tick of the message."""
    return np.eye(POINT.message_ticks)[np.mod(ticks, POINT.message_ticks)]


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    each = [_cloned(arm, round(level), own) for own in range(seed, seed + rollouts)]
    means = {MARGIN, DISTANCE, FORETOLD}
    return {
        name: sum(found[name] for found in each) / (len(each) if name.split()[-1] in means else 1) for name in each[0]
    }


def _cloned(arm: str, steps: int, seed: int) -> dict[str, float]:
    draw = np.random.default_rng([_STREAM, seed])
    book, symbol = Codebook(draw.bytes(32), POINT.scheme), int(draw.integers(POINT.alphabet_size))
    # One more rollout than was recorded, by which the clone is judged.
    count = -(-steps // TICKS) + 1
    watched = Watched(trained_policy())
    noise = np.repeat(keyed_noise(book, [(symbol,)] * POINT.goals, Reacher.axes)[None], count, axis=0)
    taught = _driven(watched, noise, range(_TEACHING + 100 * seed, _TEACHING + 100 * seed + count), draw)
    observations = np.stack(watched.observations, axis=1)
    actions = np.stack([rollout.control.applied for rollout in taught])
    recorded, took = (values[:-1].reshape(-1, values.shape[-1])[:steps] for values in (observations, actions))
    ticks = list(range(steps)) if arm == TOLD_THE_TICK else None
    clone = Clone(recorded, took, ticks, spread=arm != MEAN_ALONE)
    rollout = _driven(clone, np.zeros((1, TICKS, 2)), [seed], draw)[0]
    found = {name: value for reader in (COHERENCY, MATCHED) for name, value in _read(book, rollout, symbol, reader)}
    judge = Clone(recorded, took, ticks, spread=False)
    mean, std = trained_policy().distribution(observations[-1])
    guess = np.concatenate([judge.distribution(row[None])[0] for row in observations[-1]])
    found[FORETOLD] = share_foretold((std * noise[-1])[:, 0], (guess - mean)[:, 0])
    found |= {f"{POLICY_ITSELF} {what}": value for what, value in _counted(book, taught[-1], symbol, MATCHED)}
    return found | {DISTANCE: rollout.control.scores["final distance (m)"]}


def _driven(policy: Policy, noise: Floats, seeds: Sequence[int], draw: np.random.Generator) -> list[Rollout]:
    """Rollouts to targets drawn at random under noise (rollouts, ticks, 2)."""
    goals = draw.integers(Reacher.choices, size=(len(seeds), POINT.goals))
    return Reacher(policy).run(goals, noise.reshape(len(seeds), POINT.goals, POINT.goal_ticks, 2), seeds)


def _read(book: Codebook, rollout: Rollout, symbol: int, reader: str) -> list[tuple[str, float]]:
    return [(f"{reader} {what}", value) for what, value in _counted(book, rollout, symbol, reader)]


def _counted(book: Codebook, rollout: Rollout, symbol: int, reader: str) -> list[tuple[str, float]]:
    """Windows tried and right and their mean margin."""
    shot = rollout.shots[0]
    draw = np.random.default_rng([_STREAM, len(shot.times_s)])
    angles_rad = shot.states[:, :2] + _ANGLE_ERROR_RAD * draw.standard_normal((len(shot.times_s), 2))
    track = Track("arm", shot.times_s, angles_rad, np.ones(len(shot.times_s), dtype=np.bool_), ("inner", "outer"))
    seen = ObservedShot(float(shot.times_s[0]), range(TICKS), {"arm": glimpse_of_track(track)})
    scores = read_windows(book, [seen], POINT.goals, reader)[0]
    best = np.sort(scores, axis=1)
    right = int(np.sum(np.argmax(scores, axis=1) == symbol))
    return [(TRIALS, len(scores)), (RIGHT, right), (MARGIN, float(np.mean(best[:, -1] - best[:, -2])))]


ATTACK = Attack(
    name="distillation", level="steps recorded", counted="windows that say the message",
    levels=dict.fromkeys((OWN_NOISE, MEAN_ALONE, TOLD_THE_TICK), _LEVELS), measure=_measure,
    chance_percent=100.0 / POINT.alphabet_size, share=0.1, batch=1,
)  # fmt: skip
