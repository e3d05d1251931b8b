"""One drive of the RoboMaster's task from its start to its target, under noise or none, and what it took."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hil.fleet.chassis import chassis_of
from hil.fleet.rig import seeds_of
from hil.plants.family import ROBOMASTER
from hil.plants.mecanum import MecanumPlant, calibrated_parameters
from hil.vehicles.motion_controller import Plant
from hil.worlds.robomaster import routes
from hil.worlds.vehicles import arena_task
from mtm_audit.model.track import Floats
from mtm_onboard.model.velocity import AXES, BodyVelocity
from mtm_onboard.protocol import Channel, Codebook, Scheme
from mtm_onboard.protocol.spectrum import tone_powers
from mtm_onboard.runtime.modulator import Modulator

CLEAN, WHITE, SAME_BAND, KEYED = "clean", "white", "same band", "keyed"
# What a cost is told of.
CONDITIONS = (CLEAN, WHITE, KEYED)

# Farther from its target than this, it has not arrived; a drive without noise takes 30 to 35 s.
_ARRIVED_M = 0.15
_LONGEST_S = 60.0
_KEYS_STREAM, _NOISE_STREAM, _BAND_STREAM = 7, 8, 9

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


@dataclass(frozen=True)
class Course:
    """The poses (n + 1, 3) of one robot, x and y in m and heading in rad, the commands (n, 3) between them, and the
    corners (k, 2) of its route.
    """

    poses: Floats
    commands: Floats
    corners_xy_m: Floats


def drive(scheme: Scheme, condition: str, seed: int) -> Drive:
    """The first robot of the paper's task drives its route of that seed, its slip the same under each condition.

    Raises MtmError when a joint is among the scheme's axes.
    """
    driven, rate_hz = course(scheme, condition, seed), scheme.rate_hz
    commands = driven.commands[:, :2]
    return Drive(
        time_s=len(commands) / rate_hz,
        path_error_m=_root_mean_square(distances_m(driven.poses[:, :2], driven.corners_xy_m)),
        heading_error_deg=math.degrees(_root_mean_square(driven.poses[:, 2])),
        energy_m2ps2=float(np.mean(np.sum(commands**2, axis=1))),
        jerk_mps3=_root_mean_square(np.diff(commands, n=2, axis=0) * rate_hz**2),
    )


def course(scheme: Scheme, condition: str, seed: int, plant: str = ROBOMASTER, longest_s: float = _LONGEST_S) -> Course:
    """The first robot of the arena's task, of that kind, until it arrives or that time is over.

    White noise has the standard deviations of the channels of the scheme's first body on their axes, noise of the same
    band their spectrum as well; keyed noise is what the robot's modulators add under a key of the seed's own. Raises
    MtmError when a joint is among these axes.
    """
    rate_hz, seeds = scheme.rate_hz, seeds_of(seed)
    route = routes(seeds.permutation())[0]
    chassis = chassis_of(plant)
    robot: Plant = (
        MecanumPlant(calibrated_parameters(), seed, route.start_xy_m)
        if chassis is None else chassis(seed, route.start_xy_m)
    )  # fmt: skip
    task, add = arena_task(plant)(route, seed), _noise_of(scheme, condition, seed)
    target = np.array(route.points_xy_m[-1])
    poses, sent = [(*robot.position_xy_m, robot.heading_rad)], []
    for tick in range(int(longest_s * rate_hz)):
        now_s = tick / rate_hz
        sent.append(add(tick, task.command(robot.position_xy_m, robot.heading_rad)))
        robot.command(now_s, sent[-1])
        robot.step(now_s + 1.0 / rate_hz)
        poses.append((*robot.position_xy_m, robot.heading_rad))
        if np.hypot(*(target - poses[-1][:2])) < _ARRIVED_M:
            break
    return Course(np.array(poses), np.array(sent), np.array([route.start_xy_m, *route.points_xy_m]))


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
    if condition == SAME_BAND:
        return _of_the_band(scheme, channels, np.random.default_rng([_BAND_STREAM, seed]))
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


def _of_the_band(scheme: Scheme, channels: Sequence[Channel], draw: np.random.Generator) -> Add:
    """Stationary Gaussian noise, which knows of no windows."""
    count = int(_LONGEST_S * scheme.rate_hz)
    hz = np.fft.rfftfreq(count, 1.0 / scheme.rate_hz)
    inside = (hz >= scheme.band_hz[0]) & (hz <= scheme.band_hz[1])
    tones_hz = np.asarray(hz[inside], dtype=np.float64)
    powers = np.ones(len(tones_hz)) if scheme.spectrum is None else tone_powers(scheme.spectrum, tones_hz)
    noise = np.zeros((count, len(AXES)))
    for channel in channels:
        for axis, sigma in zip(channel.axes, channel.sigmas, strict=True):
            tones = np.zeros(len(hz), dtype=np.complex128)
            parts = draw.standard_normal((2, len(powers)))
            tones[inside] = np.sqrt(powers / len(powers)) * (parts[0] + 1j * parts[1]) * count / 2.0
            noise[:, AXES.index(axis)] += sigma * np.fft.irfft(tones, count)
    return lambda tick, base: BodyVelocity(*(base + noise[tick]))


def _white(channels: Sequence[Channel], draw: np.random.Generator) -> Add:
    variances = np.zeros(len(AXES))
    for channel in channels:
        for axis, sigma in zip(channel.axes, channel.sigmas, strict=True):
            variances[AXES.index(axis)] += sigma**2
    return lambda _, base: BodyVelocity(*(base + np.sqrt(variances) * draw.standard_normal(len(AXES))))


def _root_mean_square(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
