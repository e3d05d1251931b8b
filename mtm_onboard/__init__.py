"""What runs on the robot: a keyed message added to its velocity commands. Imports with numpy alone."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mtm_onboard.model.velocity import BodyVelocity
    from mtm_onboard.policies import (
        ActionBounds,
        KeyedActionNoise,
        KeyedGaussian,
        KeyedNoise,
        VectorKeyedActionNoise,
        VectorKeyedNoise,
        add_to_actions,
        register_with_stable_baselines3,
    )
    from mtm_onboard.protocol import Channel, Codebook, Key, MtmError, Scheme, generate_key, load_key, save_key
    from mtm_onboard.runtime.client import BaseCommandClient
    from mtm_onboard.runtime.guard import Guard, Limits, Staleness
    from mtm_onboard.runtime.message import SILENCE, message_of
    from mtm_onboard.runtime.modulator import Modulator

__all__ = [
    "SILENCE",
    "ActionBounds",
    "BaseCommandClient",
    "BodyVelocity",
    "Channel",
    "Codebook",
    "Guard",
    "Key",
    "KeyedActionNoise",
    "KeyedGaussian",
    "KeyedNoise",
    "Limits",
    "Modulator",
    "MtmError",
    "Scheme",
    "Staleness",
    "VectorKeyedActionNoise",
    "VectorKeyedNoise",
    "add_to_actions",
    "generate_key",
    "load_key",
    "message_of",
    "register_with_stable_baselines3",
    "save_key",
]

# A name's module is imported when the name is first used. Every import of mtm_onboard.protocol runs this file too, and
# the auditor, which makes such imports, has no use for the runtime.
_MODULES = {
    "mtm_onboard.model.velocity": ("BodyVelocity",),
    "mtm_onboard.policies": (
        "ActionBounds",
        "KeyedActionNoise",
        "KeyedGaussian",
        "KeyedNoise",
        "VectorKeyedActionNoise",
        "VectorKeyedNoise",
        "add_to_actions",
        "register_with_stable_baselines3",
    ),
    "mtm_onboard.protocol": (
        "Channel", "Codebook", "Key", "MtmError", "Scheme", "generate_key", "load_key", "save_key",
    ),
    "mtm_onboard.runtime.client": ("BaseCommandClient",),
    "mtm_onboard.runtime.guard": ("Guard", "Limits", "Staleness"),
    "mtm_onboard.runtime.message": ("SILENCE", "message_of"),
    "mtm_onboard.runtime.modulator": ("Modulator",),
}  # fmt: skip
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> object:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
