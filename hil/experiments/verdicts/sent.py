"""Tracks of vehicles that send, without the onboard program: noise on the demand, then the plant, then a camera."""

from collections.abc import Sequence

import numpy as np

from hil.experiments.verdicts.vehicles import Vehicle
from hil.fleet.sending import STEP_S, Sending
from hil.plants.velocity_responses import Floats
from mtm_audit.model.track import Track
from mtm_onboard.model.velocity import AXES

_WARM_UP_S = 1.0
_NOISE_M = 0.0005


def sent_track(
    name: str, vehicle: Vehicle, sendings: Sequence[Sending], seconds: float, draw: np.random.Generator
) -> Track:
    """Motion capture at 100 Hz of a vehicle that plays all of `sendings` at once; none of them for a silent one."""
    warm_up = round(_WARM_UP_S / STEP_S)
    times_s: Floats = np.arange(-warm_up, round(seconds / STEP_S) + 1, dtype=np.float64) * STEP_S
    task = vehicle.tasks[int(draw.integers(len(vehicle.tasks)))]
    demand = task(len(times_s), STEP_S, draw)
    columns = [AXES.index(axis) for axis in vehicle.axes]
    for sending in sendings:
        demand[:, columns] += sending.noise(times_s)
    positions = vehicle.drive(demand, STEP_S, draw)[warm_up:]
    seen = positions + _NOISE_M * draw.standard_normal(positions.shape)
    return Track(name, times_s[warm_up:], seen, np.ones(len(seen), dtype=np.bool_))
