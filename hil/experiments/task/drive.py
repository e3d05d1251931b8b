"""One drive of the RoboMaster's task from its start to its target, under noise or none, and what it took."""

import math
from dataclasses import dataclass

import numpy as np

from hil.experiments.task.noise import LONGEST_S, noise_of
from hil.fleet.chassis import chassis_of
from hil.fleet.rig import seeds_of
from hil.plants.family import ROBOMASTER
from hil.plants.mecanum import MecanumPlant, calibrated_parameters
from hil.vehicles.motion_controller import Plant
from hil.worlds.robomaster import routes
from hil.worlds.vehicles import arena_task
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Scheme

# Farther from its target than this, it has not arrived.
_ARRIVED_M = 0.15


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


def course(scheme: Scheme, condition: str, seed: int, plant: str = ROBOMASTER, longest_s: float = LONGEST_S) -> Course:
    """The first robot of the arena's task, of that kind, until it arrives or that time is over.

    Raises MtmError when a joint is among the scheme's axes.
    """
    rate_hz, seeds = scheme.rate_hz, seeds_of(seed)
    route = routes(seeds.permutation())[0]
    chassis = chassis_of(plant)
    robot: Plant = (
        MecanumPlant(calibrated_parameters(), seed, route.start_xy_m)
        if chassis is None else chassis(seed, route.start_xy_m)
    )  # fmt: skip
    task, add = arena_task(plant)(route, seed), noise_of(scheme, condition, seed)
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


def _root_mean_square(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
