"""The family of simulated robots at work: each kind of plant with the controllers that drive it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hil.plants.family import PLANTS, PlantKind, kind_of
from hil.plants.plant_file import load_plant
from hil.plants.responses import Floats
from hil.worlds.open_loop import cruise, pick_and_place, spinning, steering, stop_and_go, wander, zigzag
from hil.worlds.robomaster import TaskFactory, go_to_goal
from hil.worlds.tasks import TASKS, spin_to_goal, steer_to_goal
from mtm_onboard.protocol.errors import WrongValueError

# From the number of steps and their length to demanded body velocities (n, 3).
Controller = Callable[[int, float, np.random.Generator], Floats]

_COURSES = (zigzag, wander, stop_and_go)
_CONTROLLERS: dict[str, tuple[Controller, ...]] = {
    "robomaster": (zigzag,),
    "diff-drive": (steering,),
    "create": (steering,),
    "spinning": (spinning,),
    "heavy": (cruise,),
    "arm": (pick_and_place,),
    "stop-and-go": (stop_and_go,),
}


# What each does among the targets of the fleet's arena, where it is not the paper's task; an arm does not drive there.
_TASKS: dict[str, TaskFactory | None] = {
    "diff-drive": steer_to_goal,
    "create": steer_to_goal,
    "spinning": spin_to_goal,
    "arm": None,
    "stop-and-go": TASKS["stop and go"],
}


@dataclass(frozen=True)
class Vehicle:
    """A kind of plant, what it may be busy with, and its task in the fleet's arena, None where it has none."""

    kind: PlantKind
    controllers: tuple[Controller, ...]
    task: TaskFactory | None


VEHICLES: dict[str, Vehicle] = {
    name: Vehicle(kind, _CONTROLLERS.get(name, _COURSES), _TASKS.get(name, go_to_goal)) for name, kind in PLANTS.items()
}


def vehicle(name: str) -> Vehicle:
    """The vehicle of that name, or of the plant file at that path, whose name ends in `.toml`.

    Raises MtmError when there is none.
    """
    if name.endswith(".toml"):
        kind = kind_of(load_plant(Path(name)))
        steered = "vy" not in kind.axes
        return Vehicle(kind, (steering,) if steered else _COURSES, steer_to_goal if steered else go_to_goal)
    if name not in VEHICLES:
        raise WrongValueError(
            f"there is no plant {name!r}; choose from: {', '.join(VEHICLES)}, or name a plant file (.toml)"
        )
    return VEHICLES[name]


def arena_task(name: str) -> TaskFactory:
    """The vehicle's task in the fleet's arena; raises MtmError when there is no such vehicle, or it does not drive."""
    task = vehicle(name).task
    if task is None:
        able = [other for other, own in VEHICLES.items() if own.task is not None]
        raise WrongValueError(
            f"the plant {name!r} does not drive through the fleet's arena; choose from: {', '.join(able)}"
        )
    return task
