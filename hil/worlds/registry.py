"""Worlds by name, each loaded with its simulator only when it is asked for."""

from importlib import import_module

from hil.worlds.world import World
from mtm_onboard.protocol import MtmError

_MODULES = {
    "discovery": ("hil.worlds.discovery", "Discovery", "vmas"),
    "lunar-lander": ("hil.worlds.lander", "LunarLander", "gymnasium[box2d]"),
    "reacher": ("hil.worlds.reacher", "Reacher", "mujoco"),
    "football": ("hil.worlds.football", "Football", "vmas"),
}
NAMES = tuple(_MODULES)


def make_world(name: str) -> World:
    """The world of that name; raises MtmError that lists them, or says what its simulator needs."""
    if name not in _MODULES:
        raise MtmError(f"there is no world {name!r}; choose one of: {', '.join(NAMES)}")
    module, kind, package = _MODULES[name]
    try:
        world: World = getattr(import_module(module), kind)()
    except ImportError as error:
        raise MtmError(
            f"the world {name} needs {package}, and {error.name} is missing; install it with: pip install 'mtm[worlds]'"
        ) from error
    return world
