"""Vehicles for the experiments with verdicts: what each drives, which axes carry its noise, and how it follows."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hil.plants.body_path import gait, path_xy_m, slip
from hil.plants.mecanum import MecanumPlant, calibrated_parameters
from hil.plants.velocity_responses import (
    Floats,
    delayed,
    lagged,
    notched,
    saturated,
    second_order,
    slew_limited,
    sticking,
    with_play,
)
from hil.worlds.open_loop import spinning, steering, stop_and_go, wander, zigzag
from mtm_onboard.model.velocity import BodyVelocity

# From the number of steps and their length.
Task = Callable[[int, float, np.random.Generator], Floats]
# From demanded body velocities (n, 3) and the step to positions (n, 2).
Drive = Callable[[Floats, float, np.random.Generator], Floats]


@dataclass(frozen=True)
class Vehicle:
    """`axes` carry the noise, `tasks` are what it may be busy with, `drive` moves it."""

    axes: tuple[str, ...]
    tasks: tuple[Task, ...]
    drive: Drive


def _calibrated(demand: Floats, step_s: float, draw: np.random.Generator) -> Floats:
    plant = MecanumPlant(calibrated_parameters(), int(draw.integers(1 << 62)))
    positions = []
    for row, (vx_mps, vy_mps, wz_radps) in enumerate(demand.tolist()):
        plant.command(row * step_s, BodyVelocity(vx_mps, vy_mps, wz_radps))
        plant.step((row + 1) * step_s)
        positions.append(plant.position_xy_m)
    return np.array(positions)


def _on_the_ground(follow: Callable[[Floats, float, np.random.Generator], Floats]) -> Drive:
    """Follow the demand after a delay, with wheels that slip."""

    def drive(demand: Floats, step_s: float, draw: np.random.Generator) -> Floats:
        followed = follow(delayed(demand, step_s, float(draw.uniform(0.02, 0.1))), step_s, draw)
        loose = slip(demand.shape, step_s, float(draw.uniform(0.01, 0.05)), float(draw.uniform(0.05, 0.3)), draw)
        return path_xy_m(followed + loose, step_s)

    return drive


def _first_order(demand: Floats, step_s: float, draw: np.random.Generator) -> Floats:
    return lagged(demand, step_s, float(draw.uniform(0.08, 0.25)))


def _heavy(demand: Floats, step_s: float, draw: np.random.Generator) -> Floats:
    return slew_limited(lagged(demand, step_s, 0.8), step_s, float(draw.uniform(0.15, 0.5)))


def _legged(demand: Floats, step_s: float, draw: np.random.Generator) -> Floats:
    sway = gait(len(demand), step_s, float(draw.uniform(0.8, 2.5)), float(draw.uniform(0.05, 0.15)), draw)
    return _first_order(demand, step_s, draw) + sway


def _sticky(demand: Floats, step_s: float, draw: np.random.Generator) -> Floats:
    return sticking(_first_order(demand, step_s, draw), float(draw.uniform(0.03, 0.12)))


def _bent(demand: Floats, step_s: float, draw: np.random.Generator) -> Floats:
    return lagged(saturated(demand, float(draw.uniform(0.1, 0.4))), step_s, 0.12)


def _geared(demand: Floats, step_s: float, draw: np.random.Generator) -> Floats:
    return with_play(_first_order(demand, step_s, draw), step_s, float(draw.uniform(0.002, 0.02)))


def _flying(demand: Floats, step_s: float, draw: np.random.Generator) -> Floats:
    return second_order(demand, step_s, float(draw.uniform(0.5, 1.5)), float(draw.uniform(0.3, 0.9)))


def _notched(demand: Floats, step_s: float, draw: np.random.Generator) -> Floats:
    notch_hz, quality = float(draw.uniform(1.0, 4.0)), float(draw.uniform(0.5, 2.0))
    return _first_order(notched(demand, step_s, notch_hz, quality), step_s, draw)


_WORLD, _COURSES = ("vx", "vy"), (zigzag, wander, stop_and_go)

CALIBRATED = "calibrated"
VEHICLES: dict[str, Vehicle] = {
    CALIBRATED: Vehicle(_WORLD, (zigzag,), _calibrated),
    "differential drive": Vehicle(("vx", "wz"), (steering,), _on_the_ground(_first_order)),
    "heavy, slew limit": Vehicle(_WORLD, _COURSES, _on_the_ground(_heavy)),
    "legged, gait in band": Vehicle(_WORLD, _COURSES, _on_the_ground(_legged)),
    "stop and go": Vehicle(_WORLD, (stop_and_go,), _on_the_ground(_sticky)),
    "spinning holonomic": Vehicle(_WORLD, (spinning,), _on_the_ground(_first_order)),
    "tanh gain": Vehicle(_WORLD, _COURSES, _on_the_ground(_bent)),
    "backlash": Vehicle(_WORLD, _COURSES, _on_the_ground(_geared)),
    "quadrotor": Vehicle(_WORLD, _COURSES, _on_the_ground(_flying)),
    "notch in the command path": Vehicle(_WORLD, _COURSES, _on_the_ground(_notched)),
}
