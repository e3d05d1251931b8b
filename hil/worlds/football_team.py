"""A team of three that plays football by rules, and the 64 strategies that it plays by.

Two go for the ball and push it side by side, since one alone does not get it past an opponent as strong as itself; the
third keeps a formation. Every agent follows a wanted velocity under a controller of position and velocity (PD). The
paper does not say by what rules its team plays.
"""

from dataclasses import dataclass

import numpy as np

from hil.worlds.world import Integers
from mtm_audit.model.track import Floats

# How fast the team goes; VMAS lets nobody go faster than 0.15 m/s.
TEMPOS_MPS = (0.12, 0.13, 0.14, 0.15)
# On which side of the pitch (1: left, seen from its own goal) it goes around the ball and aims into the goal.
BIASES = (-1.0, 1.0)
# Where the third stands: ahead of the ball, and to the favoured side of it.
FORMATIONS_M = ((-0.5, 0.1), (-0.15, 0.4), (0.35, 0.3), (-0.12, 0.0))
PASSES_EVERY_S = (15.0, 5.0)
STRATEGIES = len(TEMPOS_MPS) * len(BIASES) * len(FORMATIONS_M) * len(PASSES_EVERY_S)

GOAL_XY_M = np.array([1.51, 0.0])
_TICK_S = 0.1
_PASS_S = 1.5
_PASS_AHEAD_M = 0.1
_AIM_ASIDE_M = 0.06
# How far agents can go, a radius from the lines.
_PITCH_M = np.array([1.45, 0.70])
# Distance of an agent's centre from the ball's when they touch.
_CONTACT_M = 0.045
# Each of the two on the ball keeps so far to its side of the ball's middle.
_ASIDE_M = 0.026
_LEAD_S = 0.3
# Who stood back so far goes on doing so unless nearer to the ball than another by this much.
_NEARER_M = 0.06
# Action per error of velocity, and per velocity to hold it against the drag.
_GAIN_S_PER_M = 12.0
_HOLD_S_PER_M = 5.0
# Velocity per error of position: to a place, to a point beside the ball, and sideways while pushing.
_TO_PLACE_1_PER_S, _TO_BALL_1_PER_S, _SIDEWAYS_1_PER_S = 1.5, 3.0, 2.5


@dataclass(frozen=True)
class Strategies:
    """What each of n teams does: speed, side that it favours, place of the third (n, 2), and how often it passes."""

    tempos_mps: Floats
    biases: Floats
    formations_m: Floats
    passes_every_s: Floats


def strategies(numbers: Integers) -> Strategies:
    """The strategies of these numbers (n,), from 0 to 63; no two are alike."""
    rest, passing = np.divmod(numbers, len(PASSES_EVERY_S))
    rest, formation = np.divmod(rest, len(FORMATIONS_M))
    tempo, bias = np.divmod(rest, len(BIASES))
    return Strategies(
        np.array(TEMPOS_MPS)[tempo],
        np.array(BIASES)[bias],
        np.array(FORMATIONS_M)[formation],
        np.array(PASSES_EVERY_S)[passing],
    )


@dataclass(frozen=True)
class GameState:
    """What n teams observe: positions and velocities of their agents (n, 3, 2) and of the ball (n, 2)."""

    own_xy_m: Floats
    own_mps: Floats
    ball_xy_m: Floats
    ball_mps: Floats


class Team:
    """The rules, for n games at once; it remembers the time and who stands back."""

    def __init__(self, games: int) -> None:
        self._games = np.arange(games)
        self._standing_back = np.full(games, -1)
        self._time_s = 0.0

    def actions(self, chosen: Strategies, sight: GameState) -> Floats:
        """The next action of every agent, (n, 3, 2), within -1 and 1."""
        ball_xy_m = sight.ball_xy_m + _LEAD_S * sight.ball_mps
        towards = _unit(self._aims_xy_m(chosen, sight) - ball_xy_m)
        across = np.column_stack([-towards[:, 1], towards[:, 0]])
        first, second, third = self._roles(sight.own_xy_m, ball_xy_m - 1.5 * _CONTACT_M * towards)
        wanted_mps = np.zeros_like(sight.own_xy_m)
        wanted_mps[self._games, third] = _keep_place(chosen, sight, sight.own_xy_m[self._games, third])
        places_xy_m = sight.own_xy_m[self._games, first], sight.own_xy_m[self._games, second]
        first_is_left = np.sum((places_xy_m[0] - places_xy_m[1]) * across, axis=1) > 0.0
        sides = np.where(first_is_left, 1.0, -1.0)
        for who, own_xy_m, side in zip((first, second), places_xy_m, (sides, -sides), strict=True):
            wanted_mps[self._games, who] = _drive(chosen, own_xy_m, ball_xy_m, towards, _ASIDE_M * side)
        self._time_s += _TICK_S
        actions = _HOLD_S_PER_M * wanted_mps + _GAIN_S_PER_M * (wanted_mps - sight.own_mps)
        return np.clip(actions, -1.0, 1.0)

    def _aims_xy_m(self, chosen: Strategies, sight: GameState) -> Floats:
        """Where each ball is to go: into the goal, now and then to the foremost of the team."""
        aside_m = _AIM_ASIDE_M * chosen.biases
        goal_xy_m = GOAL_XY_M + np.column_stack([np.zeros_like(aside_m), aside_m])
        mate_xy_m = sight.own_xy_m[self._games, np.argmax(sight.own_xy_m[..., 0], axis=1)]
        passing = np.mod(self._time_s, chosen.passes_every_s) > chosen.passes_every_s - _PASS_S
        passing &= mate_xy_m[:, 0] > sight.ball_xy_m[:, 0] + _PASS_AHEAD_M
        return np.asarray(np.where(passing[:, None], mate_xy_m, goal_xy_m))

    def _roles(self, own_xy_m: Floats, behind_xy_m: Floats) -> Integers:
        """Numbers (3, n) of the nearest to the point behind the ball, of the second, and of who stands back."""
        distances_m = np.linalg.norm(own_xy_m - behind_xy_m[:, None], axis=-1)
        distances_m += _NEARER_M * (np.arange(3) == self._standing_back[:, None])
        order: Integers = np.argsort(distances_m, axis=1).T
        self._standing_back = order[2]
        return order


def _keep_place(chosen: Strategies, sight: GameState, own_xy_m: Floats) -> Floats:
    """Velocities (n, 2) of those who stand back, to their places in the formation."""
    places_m = chosen.formations_m * np.column_stack([np.ones_like(chosen.biases), chosen.biases])
    target_xy_m = np.clip(sight.ball_xy_m + places_m, -_PITCH_M, _PITCH_M)
    return _limited(_TO_PLACE_1_PER_S * (target_xy_m - own_xy_m), chosen.tempos_mps)


def _drive(chosen: Strategies, own_xy_m: Floats, ball_xy_m: Floats, towards: Floats, aside_m: Floats) -> Floats:
    """Velocities (n, 2) of those on the ball: around it to its far side, then through it, `aside_m` left of it."""
    across = np.column_stack([-towards[:, 1], towards[:, 0]])
    ahead_m = np.sum((ball_xy_m - own_xy_m) * towards, axis=1)
    left_m = np.sum((own_xy_m - ball_xy_m) * across, axis=1)
    in_line = (ahead_m > 0.0) & (np.abs(left_m) < 0.4 * np.maximum(ahead_m, _CONTACT_M) + np.abs(aside_m))
    pushing_mps = towards * chosen.tempos_mps[:, None] + across * (_SIDEWAYS_1_PER_S * (aside_m - left_m))[:, None]
    # Around the ball on the side where the agent is, in doubt on the favoured one.
    side = np.where(np.abs(left_m) > 0.03, np.sign(left_m), chosen.biases)
    beside_m = np.where(ahead_m < _CONTACT_M, 1.6 * _CONTACT_M * side, aside_m)
    target_xy_m = ball_xy_m - 1.3 * _CONTACT_M * towards + across * beside_m[:, None]
    going_mps = _TO_BALL_1_PER_S * (target_xy_m - own_xy_m)
    return _limited(np.where(in_line[:, None], pushing_mps, going_mps), chosen.tempos_mps)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))


def _limited(velocities_mps: Floats, limits_mps: Floats) -> Floats:
    """The velocities (n, 2) made no faster than the limits (n,)."""
    speeds_mps = np.linalg.norm(velocities_mps, axis=-1, keepdims=True)
    return np.asarray(velocities_mps * np.minimum(1.0, limits_mps[:, None] / np.maximum(speeds_mps, 1e-9)))
