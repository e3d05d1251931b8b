"""Simulated robots behind pseudo-terminals and UDP ports, for programs in other processes."""

from collections.abc import Callable
from dataclasses import dataclass

from hil.fleet.rig import Wire
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.mavlink_firmware import COPTER
from hil.vehicles.mavlink_vehicle import MavlinkVehicle
from hil.vehicles.motion_controller import MotionController, Plant
from hil.vehicles.plaintext_node import PlaintextMotionController
from hil.wires.plaintext_ports import PtyPort
from hil.wires.slcan_port import SlcanPort
from mtm_onboard.links.mavlink_ports import UdpPort


@dataclass(frozen=True)
class SerialWire:
    """One robot: the TOML fields of [transport] that reach it, its periodic `poll`, and the count of `faults`.

    `stop_releases_motors` says whether a stop over this wire switches the motors off as well.
    """

    transport: str
    controller: MotionController
    poll: Callable[[float], None]
    faults: Callable[[], int]
    shutdown: Callable[[], None]
    stop_releases_motors: bool = True


def serial_wire(wire: Wire, plant: Plant) -> SerialWire:
    """`plant` behind a UART for "plaintext", a UDP port for "mavlink", and a serial CAN adapter otherwise."""
    if wire == "mavlink":
        return _autopilot(plant)
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


def _autopilot(plant: Plant) -> SerialWire:
    port = UdpPort(listen=("127.0.0.1", 0))
    vehicle = MavlinkVehicle(COPTER, plant, port, is_guided=True, is_armed=True)

    def faults() -> int:
        return vehicle.refused_frames + vehicle.ignored_setpoints + vehicle.port_errors + vehicle.controller.faults

    transport = f'kind = "mavlink"\nprofile = "copter"\nendpoint = "udpout:127.0.0.1:{port.number}"'
    return SerialWire(transport, vehicle.controller, vehicle.poll, faults, port.close, stop_releases_motors=False)
