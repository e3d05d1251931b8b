"""Worlds by name, each loaded with its simulator only when it is asked for."""

from importlib import import_module
from importlib.util import find_spec

from hil.worlds.world import World
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.errors import WrongValueError
from mtm_onboard.protocol.installing import install_command

# The module and class of each, and the packages of its simulator.
_MODULES = {
    "discovery": ("hil.worlds.discovery", "Discovery", ("vmas", "torch")),
    "lunar-lander": ("hil.worlds.lander", "LunarLander", ("gymnasium", "Box2D")),
    "reacher": ("hil.worlds.reacher", "Reacher", ("gymnasium", "mujoco")),
    "football": ("hil.worlds.football", "Football", ("vmas", "torch")),
}
NAMES = tuple(_MODULES)


def make_world(name: str) -> World:
    """The world of that name; raises MtmError that lists them, or says what its simulator needs."""
    if name not in _MODULES:
        raise WrongValueError(f"there is no world {name!r}; choose one of: {', '.join(NAMES)}")
    module, kind, packages = _MODULES[name]
    # Looked for and not imported: VMAS and torch take seconds, and are imported when the world is run.
    missing = [package for package in packages if find_spec(package) is None]
    if missing:
        raise MtmError(
            f"the world {name} needs {' and '.join(packages)}, and {missing[0]} is missing; install it with: "
            f"{install_command('worlds')}"
        )
    world: World = getattr(import_module(module), kind)()
    return world
