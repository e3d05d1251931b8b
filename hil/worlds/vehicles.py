"""The family of simulated robots at work: each kind of plant with the controllers that drive it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hil.plants.family import PLANTS, PlantKind
from hil.plants.responses import Floats
from hil.worlds.open_loop import cruise, pick_and_place, spinning, steering, stop_and_go, wander, zigzag
from mtm_onboard.protocol import MtmError

# From the number of steps and their length to demanded body velocities (n, 3).
Controller = Callable[[int, float, np.random.Generator], Floats]

_COURSES = (zigzag, wander, stop_and_go)
_CONTROLLERS: dict[str, tuple[Controller, ...]] = {
    "robomaster": (zigzag,),
    "diff-drive": (steering,),
    "spinning": (spinning,),
    "heavy": (cruise,),
    "arm": (pick_and_place,),
    "stop-and-go": (stop_and_go,),
}


@dataclass(frozen=True)
class Vehicle:
    """A kind of plant, and what it may be busy with."""

    kind: PlantKind
    controllers: tuple[Controller, ...]


VEHICLES: dict[str, Vehicle] = {name: Vehicle(kind, _CONTROLLERS.get(name, _COURSES)) for name, kind in PLANTS.items()}


def vehicle(name: str) -> Vehicle:
    """The vehicle of that name; raises MtmError when there is none."""
    if name not in VEHICLES:
        raise MtmError(f"there is no plant {name!r}; choose from: {', '.join(VEHICLES)}")
    return VEHICLES[name]
