"""From the [transport] table of the robot's configuration to a link; only the link in use is imported."""

from importlib import import_module

from mtm_onboard.links.base import Link
from mtm_onboard.protocol.errors import MtmError

# kind -> module and class; the table's other fields are the class's keyword arguments.
_KINDS = {
    "none": ("mtm_onboard.links.none", "NullLink"),
    "robomaster-can": ("mtm_onboard.links.robomaster_can", "RoboMasterCan"),
    "mavlink": ("mtm_onboard.links.mavlink", "MavlinkLink"),
    "robomaster-uart": ("mtm_onboard.links.robomaster_uart", "RoboMasterUart"),
    "robomaster-tcp": ("mtm_onboard.links.robomaster_tcp", "RoboMasterTcp"),
}


def make_link(kind: str, options: dict[str, str | int | float | bool]) -> Link:
    """An unopened link; raises MtmError for an unknown kind, options it does not take or a library it lacks."""
    if kind not in _KINDS:
        raise MtmError(f"the transport kind is {kind!r}; choose one of: {', '.join(_KINDS)}")
    module, name = _KINDS[kind]
    try:
        transport: Link = getattr(import_module(module), name)(**options)
    except ImportError as error:
        raise MtmError(f"transport {kind!r} needs {error.name}; install it") from error
    except TypeError as error:
        raise MtmError(f"transport {kind!r} does not take these options ({error}); correct [transport]") from error
    return transport
