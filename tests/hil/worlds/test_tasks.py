from functools import cache

import numpy as np
import pytest

from hil.fleet.lockstep import run_lockstep
from hil.plants.robots import SteppedRobot
from hil.worlds.robomaster import routes
from hil.worlds.tasks import TASKS, random_task, steer_to_goal
from hil.worlds.vehicles import VEHICLES, arena_task
from mtm_onboard.model.velocity import STOP
from tests.hil.fleet.short_runs import short_run

SECONDS = 12.0
ROUTE = routes((0, 1, 2, 3))[0]


@cache
def driven(name, seed=1):
    """A run of four robots on one errand, without a message."""
    return run_lockstep(short_run(symbols=None, seconds=SECONDS, seed=seed, task=TASKS[name]))


def velocities_mps(name, robot=0, seed=1):
    trajectory = driven(name, seed).trajectories[robot]
    return np.diff(trajectory.positions_xy_m, axis=0) / np.diff(trajectory.times_s)[:, None]


def band_mps(velocities, low_hz, high_hz):
    """Root mean square of each axis between two frequencies."""
    spectrum = np.abs(np.fft.rfft(velocities - velocities.mean(axis=0), axis=0)) ** 2
    frequencies_hz = np.fft.rfftfreq(len(velocities), 0.01)
    inside = (frequencies_hz >= low_hz) & (frequencies_hz <= high_hz)
    return np.sqrt(2.0 * spectrum[inside].sum(axis=0)) / len(velocities)


@pytest.mark.parametrize("name", TASKS)
def test_every_errand_is_driven_within_the_limits(name):
    assert all(robot.is_clean and robot.clamped == 0 for robot in driven(name).robots)


@pytest.mark.parametrize("name", TASKS)
def test_an_errand_moves_the_robot_within_two_and_a_half_metres(name):
    for trajectory in driven(name).trajectories:
        away_m = np.linalg.norm(trajectory.positions_xy_m - trajectory.positions_xy_m[0], axis=1)
        assert 0.05 < away_m.max() < 2.5


@pytest.mark.parametrize("name", [name for name in TASKS if name != "zigzag"])
def test_an_errand_is_another_one_for_another_seed(name):
    ours, others = TASKS[name](ROUTE, 1), TASKS[name](ROUTE, 2)
    again = TASKS[name](ROUTE, 1)
    commands = [[task.command((-0.5, -1.5), 0.0) for _ in range(200)] for task in (ours, others, again)]
    assert commands[0] == commands[2]
    assert commands[0] != commands[1]


def test_a_stop_and_go_robot_stands_still_between_its_drives():
    commands = []
    task, position = TASKS["stop and go"](ROUTE, 3), np.array(ROUTE.start_xy_m)
    for _ in range(600):
        command = task.command((position[0], position[1]), 0.0)
        commands.append(np.hypot(command.vx_mps, command.vy_mps))
        position = position + 0.02 * np.array([command.vx_mps, command.vy_mps])
    assert 0.1 < np.mean(np.array(commands) == 0.0) < 0.7
    assert max(commands) > 0.5


def test_an_orbit_keeps_its_distance_from_one_point():
    positions_xy_m = driven("orbit").trajectories[1].positions_xy_m[300:]
    columns = np.column_stack([2.0 * positions_xy_m, np.ones(len(positions_xy_m))])
    x_m, y_m, _ = np.linalg.lstsq(columns, np.sum(positions_xy_m**2, axis=1), rcond=None)[0]
    radii_m = np.hypot(positions_xy_m[:, 0] - x_m, positions_xy_m[:, 1] - y_m)
    assert np.ptp(radii_m) < 0.1 * radii_m.mean()


def test_a_reciprocating_robot_moves_along_one_line_in_the_band():
    velocities = velocities_mps("reciprocate")
    spread = np.linalg.eigvalsh(np.cov(velocities.T))
    assert spread[0] < 0.2 * spread[1]
    assert np.linalg.norm(band_mps(velocities, 0.5, 2.0)) > 0.1


def test_an_exploring_robot_is_as_loud_in_the_band_as_a_message():
    quiet, loud = (band_mps(velocities_mps(name), 2.0, 5.0) for name in ("stop and go", "explore"))
    assert np.all(loud > 1.3 * quiet)
    alone = np.array([
        (command.vx_mps, command.vy_mps)
        for task in [TASKS["explore"](ROUTE, 5)]
        for command in [task.command(ROUTE.start_xy_m, 0.0) for _ in range(1500)]
    ])  # fmt: skip
    assert band_mps_of_ticks(alone) == pytest.approx(0.1, rel=0.15)


def band_mps_of_ticks(commands):
    """The same of commands at the control rate, both axes' mean."""
    spectrum = np.abs(np.fft.rfft(commands - commands.mean(axis=0), axis=0)) ** 2
    inside = (np.fft.rfftfreq(len(commands), 0.02) >= 0.5) & (np.fft.rfftfreq(len(commands), 0.02) <= 5.0)
    return float(np.mean(np.sqrt(2.0 * spectrum[inside].sum(axis=0)) / len(commands)))


def test_a_hovering_robot_is_thrown_and_comes_back():
    trajectory = driven("hover").trajectories[0]
    away_m = np.linalg.norm(trajectory.positions_xy_m - trajectory.positions_xy_m[0], axis=1)
    assert away_m.max() > 0.1
    assert np.median(away_m) < 0.3


def test_robots_of_one_run_are_given_different_errands():
    kinds = {type(random_task(ROUTE, seed)).__name__ for seed in range(40)}
    assert len(kinds) == len(TASKS)


@pytest.mark.parametrize("name", ["diff-drive", "spinning"])
def test_a_robot_of_another_kind_reaches_the_first_points(name):
    def chassis(seed, place):
        return SteppedRobot(VEHICLES[name].kind.draw(np.random.default_rng(seed)), seed, place)

    settings = short_run(symbols=None, seconds=SECONDS, seed=1, task=arena_task(name), chassis=chassis)
    positions_m = run_lockstep(settings).trajectories[0].positions_xy_m
    for point in routes((0, 1, 2, 3))[0].points_xy_m[:2]:
        assert np.min(np.hypot(*(positions_m - point).T)) < 0.25


def test_a_steered_robot_is_never_sent_sideways():
    task = steer_to_goal(ROUTE, 0)
    commands = [task.command(ROUTE.start_xy_m, heading_rad) for heading_rad in np.linspace(-4.0, 4.0, 30)]
    assert all(command.vy_mps == 0.0 and command.vx_mps >= 0.0 for command in commands)
    assert task.command(ROUTE.points_xy_m[-1], 0.0) != STOP
    for point in ROUTE.points_xy_m:
        last = task.command(point, 0.0)
    assert last == STOP
