"""One drive of the RoboMaster's task from its start to its target, under noise or none, and what it took."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hil.fleet.rig import seeds_of
from hil.plants.mecanum import MecanumPlant, calibrated_parameters
from hil.worlds.robomaster import GoToGoal, routes
from mtm_audit.model.track import Floats
from mtm_onboard.model.velocity import AXES, BodyVelocity
from mtm_onboard.protocol import Channel, Codebook, Scheme
from mtm_onboard.runtime.modulator import Modulator

CLEAN, WHITE, KEYED = "clean", "white", "keyed"
CONDITIONS = (CLEAN, WHITE, KEYED)

# Farther from its target than this, it has not arrived; a drive without noise takes 30 to 35 s.
_ARRIVED_M = 0.15
_LONGEST_S = 60.0
_KEYS_STREAM, _NOISE_STREAM = 7, 8

# A base command and the number of its tick to what is sent.
Add = Callable[[int, BodyVelocity], BodyVelocity]


@dataclass(frozen=True)
class Drive:
    """What one drive took.

    `time_s` to the target; root mean squares of the distance from the route (m), of the heading's error (degrees) and
    of the commands' jerk (m/s^3, of the translation); `energy`, the mean square of the commanded speed (m^2/s^2).
    """

    time_s: float
    path_error_m: float
    heading_error_deg: float
    energy_m2ps2: float
    jerk_mps3: float


def drive(scheme: Scheme, condition: str, seed: int) -> Drive:
    """The first robot of the paper's task drives its route of that seed, its slip the same under each condition.

    White noise has the standard deviations of the channels of the scheme's first body on their axes; keyed noise is
    what the robot's modulators add under a key of the seed's own. Raises MtmError when a joint is among these axes.
    """
    rate_hz, route = scheme.rate_hz, routes(seeds_of(seed).permutation())[0]
    plant = MecanumPlant(calibrated_parameters(), seed, route.start_xy_m)
    task, add = GoToGoal(route), _noise_of(scheme, condition, seed)
    target = np.array(route.points_xy_m[-1])
    places, headings, sent = [plant.position_xy_m], [plant.heading_rad], []
    for tick in range(int(_LONGEST_S * rate_hz)):
        now_s = tick / rate_hz
        sent.append(add(tick, task.command(plant.position_xy_m, plant.heading_rad)))
        plant.command(now_s, sent[-1])
        plant.step(now_s + 1.0 / rate_hz)
        places.append(plant.position_xy_m)
        headings.append(plant.heading_rad)
        if np.hypot(*(target - places[-1])) < _ARRIVED_M:
            break
    commands = np.array(sent)[:, :2]
    away_m = distances_m(np.array(places), np.array([route.start_xy_m, *route.points_xy_m]))
    jerks = np.diff(commands, n=2, axis=0) * rate_hz**2
    return Drive(
        time_s=len(sent) / rate_hz,
        path_error_m=_root_mean_square(away_m),
        heading_error_deg=math.degrees(_root_mean_square(np.array(headings))),
        energy_m2ps2=float(np.mean(np.sum(commands**2, axis=1))),
        jerk_mps3=_root_mean_square(jerks),
    )


def distances_m(places_xy_m: Floats, corners_xy_m: Floats) -> Floats:
    """Distance (n,) of places (n, 2) from the nearest point of the line through corners (k, 2)."""
    starts, sides = corners_xy_m[:-1], np.diff(corners_xy_m, axis=0)
    away = places_xy_m[:, None, :] - starts
    along = np.clip(np.einsum("nkd,kd->nk", away, sides) / np.sum(sides**2, axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(away - along[..., None] * sides, axis=2).min(axis=1))


def _noise_of(scheme: Scheme, condition: str, seed: int) -> Add:
    channels = [channel for channel in scheme.channels if channel.body == scheme.channels[0].body]
    if condition == KEYED:
        return _keyed(scheme, channels, np.random.default_rng([_KEYS_STREAM, seed]))
    if condition == WHITE:
        return _white(channels, np.random.default_rng([_NOISE_STREAM, seed]))
    return lambda _, base: base


def _keyed(scheme: Scheme, channels: Sequence[Channel], draw: np.random.Generator) -> Add:
    codebook = Codebook(draw.bytes(32), scheme)
    symbols = [draw.integers(scheme.alphabet_size, size=channel.symbols).tolist() for channel in channels]
    modulators = [Modulator(codebook, *each) for each in zip([own.name for own in channels], symbols, strict=True)]
    for modulator in modulators:
        modulator.require_body_axes()

    def play(tick: int, base: BodyVelocity) -> BodyVelocity:
        for modulator in modulators:
            base = modulator.add(tick, base)
            modulator.prepare(tick)
        return base

    return play


def _white(channels: Sequence[Channel], draw: np.random.Generator) -> Add:
    variances = np.zeros(len(AXES))
    for channel in channels:
        for axis, sigma in zip(channel.axes, channel.sigmas, strict=True):
            variances[AXES.index(axis)] += sigma**2
    return lambda _, base: BodyVelocity(*(base + np.sqrt(variances) * draw.standard_normal(len(AXES))))


def _root_mean_square(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
