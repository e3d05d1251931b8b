"""Simulated robots behind pseudo-terminals, which a program in another process takes for serial devices."""

from collections.abc import Callable
from dataclasses import dataclass

from hil.rig import Wire
from hil.robots.can_node import CanMotionController
from hil.robots.motion_controller import MotionController, Plant
from hil.robots.plaintext_node import PlaintextMotionController
from hil.robots.plaintext_ports import PtyPort
from hil.robots.slcan_port import SlcanPort


@dataclass(frozen=True)
class SerialWire:
    """One robot: the TOML fields of [transport] that reach it, what it does each period, and what it found wrong."""

    transport: str
    controller: MotionController
    poll: Callable[[float], None]
    faults: Callable[[], int]
    shutdown: Callable[[], None]


def serial_wire(wire: Wire, plant: Plant) -> SerialWire:
    """`plant` behind a UART for the wire "plaintext", and behind a serial CAN adapter otherwise."""
    return _uart(plant) if wire == "plaintext" else _can_adapter(plant)


def _can_adapter(plant: Plant) -> SerialWire:
    port = SlcanPort()
    node = CanMotionController(MotionController(plant), port)

    def faults() -> int:
        return node.faults + node.ignored_messages + node.malformed_messages + node.bus_errors

    transport = f'kind = "robomaster-can"\ninterface = "slcan"\nchannel = "{port.path}"\nsleep_after_open = 0'
    return SerialWire(transport, node.controller, node.poll, faults, port.shutdown)


def _uart(plant: Plant) -> SerialWire:
    port = PtyPort()
    # As on the robot there is no deadman: what stops it is the program alone.
    node = PlaintextMotionController(MotionController(plant, deadman_s=None), [port])
    transport = f'kind = "robomaster-uart"\nport = "{port.path}"'
    return SerialWire(transport, node.controller, node.poll, lambda: node.faults, port.shutdown)
