"""The chassis of a run's robots, by the name of their kind."""

import numpy as np

from hil.fleet.rig import ChassisFactory
from hil.plants.family import ROBOMASTER
from hil.plants.robots import SteppedRobot
from hil.worlds.vehicles import vehicle

_STREAM = 731


def chassis_of(plant: str) -> ChassisFactory | None:
    """Robots of the kind, each drawn from its own seed; None for the calibrated one, which is the rig's own.

    Raises MtmError when there is no such kind.
    """
    if plant == ROBOMASTER:
        return None
    kind = vehicle(plant).kind
    return lambda seed, place: SteppedRobot(kind.draw(np.random.default_rng([_STREAM, seed])), seed, place)
