"""A CAN bus as python-can gives it, opened as a RoboMaster needs it."""

from typing import TYPE_CHECKING, Any, Protocol

from mtm_onboard.links.robomaster_messages import BITRATE
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.installing import install_command

if TYPE_CHECKING:
    import can


class Bus(Protocol):
    """What is used of a python-can bus."""

    def send(self, msg: "can.Message", timeout: float | None = None) -> None:
        """Put one frame on the bus."""
        ...

    def recv(self, timeout: float | None = None) -> "can.Message | None":
        """The next frame, None when there is none within `timeout` seconds."""
        ...

    def shutdown(self) -> None:
        """Release the bus."""
        ...


def open_bus(options: dict[str, Any]) -> Bus:
    """The bus that `options`, those of `can.Bus`, name; at the robot's bit rate unless they say otherwise.

    Raises MtmError when python-can is missing, when the bus cannot be had, and when another program has the adapter.
    """
    try:
        import can
    except ImportError:
        raise MtmError(
            f"CAN needs python-can, which is not installed; install it with: {install_command('can')}"
        ) from None
    options = {"bitrate": BITRATE, **options}
    try:
        if options.get("interface") == "slcan":
            from mtm_onboard.links.slcan_bus import SlcanBus

            return SlcanBus(**{name: value for name, value in options.items() if name != "interface"})
        return can.Bus(**options)
    except (can.CanError, OSError, ValueError, TypeError) as error:
        raise MtmError(f"The CAN bus cannot be opened ({error}); check the interface and the channel.") from error
