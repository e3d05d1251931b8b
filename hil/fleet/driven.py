"""Tracks of vehicles that send, without the onboard program: noise on the demand, then the plant, then a camera."""

from collections.abc import Sequence

import numpy as np

from hil.fleet.sending import STEP_S, Sending
from hil.plants.responses import Floats
from hil.plants.robots import Robot, driven
from hil.worlds.vehicles import Vehicle
from mtm_audit.model.track import Track
from mtm_onboard.model.velocity import AXES

WARM_UP_S = 1.0
_NOISE_M, _NOISE_RAD = 0.0005, 0.002


def sent_track(
    name: str,
    vehicle: Vehicle,
    sendings: Sequence[Sending],
    seconds: float,
    draw: np.random.Generator,
    robot: Robot | None = None,
) -> Track:
    """Motion capture at 100 Hz of a vehicle that plays all of `sendings` at once; none of them for a silent one.

    Positions have noise of 0.5 mm, headings of 2 mrad. `robot` is one drawn before; None draws one.
    """
    robot = vehicle.kind.draw(draw) if robot is None else robot
    warm_up = round(WARM_UP_S / STEP_S)
    times_s: Floats = np.arange(-warm_up, round(seconds / STEP_S) + 1, dtype=np.float64) * STEP_S
    controller = vehicle.controllers[int(draw.integers(len(vehicle.controllers)))]
    demand = controller(len(times_s), STEP_S, draw)
    columns = [AXES.index(axis) for axis in vehicle.kind.axes]
    for sending in sendings:
        demand[:, columns] += sending.noise(times_s)
    poses = driven(robot, demand, draw, STEP_S)[warm_up:]
    seen = poses + np.array([_NOISE_M, _NOISE_M, _NOISE_RAD]) * draw.standard_normal(poses.shape)
    headings = seen[:, 2] if vehicle.kind.has_heading else None
    return Track(name, times_s[warm_up:], seen[:, :2], np.ones(len(seen), dtype=np.bool_), headings_rad=headings)
