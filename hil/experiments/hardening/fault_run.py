"""One robot under one fault of its wire: the onboard runtime and a link that comes back, in simulated time.

Both the ticks and the link's service are called by the clock, so that ticks go on while the service waits for a link to
open, as in two threads.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hil.fleet.clock import SimulatedClock
from hil.fleet.rig import LIMITS, SAMPLE_PERIOD_S
from hil.plants.mecanum import MecanumPlant, calibrated_parameters
from hil.sensors.poses import Floats
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.mavlink_firmware import COPTER
from hil.vehicles.mavlink_vehicle import MavlinkVehicle
from hil.vehicles.motion_controller import DEADMAN_S, MotionController
from hil.vehicles.plaintext_node import PlaintextMotionController
from hil.wires.faulty_wire import FaultyBus, FaultyPort, FaultyText, FaultyTextPort, FaultyWire, WireFaults
from hil.wires.plaintext_line import LineLink
from hil.worlds.robomaster import Route
from hil.worlds.tasks import TASKS
from mtm_onboard.journal.journal import Journal, JournalHeader
from mtm_onboard.links.base import Link
from mtm_onboard.links.mavlink import MavlinkLink
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.links.robomaster_can import RoboMasterCan
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.protocol.journal_file import JournalRecord, read_journal
from mtm_onboard.runtime.guard import Guard, Staleness, body_sigmas
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.source import HeldSource
from mtm_onboard.runtime.tick import Runtime

# Tick 0; the fault from then on; a lost link between these two; the last base command; the end.
START_S, FAULT_S, LOST_S, FOUND_S, SILENT_S, END_S = 0.5, 2.0, 10.0, 15.0, 34.5, 40.0
# Of the robot at the far end, by wire; the plaintext robot has none.
DEADMEN_S: dict[str, float | None] = {"can": DEADMAN_S, "plaintext": None, "mavlink": COPTER.loss_s}


@dataclass(frozen=True)
class Fault:
    """A fault of the wire, and of how the robot follows a command.

    Commands are rounded to `grain` and held within `most`, both in m/s and rad/s on each axis.
    """

    wire: WireFaults = field(default_factory=WireFaults)
    grain: float = 0.0
    most: float = np.inf


@dataclass(frozen=True)
class FaultRun:
    """The record of a run.

    `in_force` are the commands that the robot's controller took up and when, its own stops included; `motion`
    (samples, 3) its true pose x, y, heading every 10 ms; `journal` what the runtime says it sent; `losses` how often
    the link was lost.
    """

    in_force: tuple[tuple[float, BodyVelocity], ...]
    motion: Floats
    journal: JournalRecord
    losses: int


class _ImpairedPlant(MecanumPlant):
    """A chassis that rounds and saturates commands, and records the commands that it is given."""

    def __init__(self, seed: int) -> None:
        super().__init__(calibrated_parameters(), seed)
        self.commands: list[tuple[float, BodyVelocity]] = []
        self.fault = Fault()

    def command(self, now_s: float, velocity: BodyVelocity) -> None:
        self.commands.append((now_s, velocity))
        grain, most = self.fault.grain, self.fault.most
        rounded = [round(value / grain) * grain if grain else value for value in velocity]
        super().command(now_s, BodyVelocity(*(max(-most, min(most, value)) for value in rounded)))


@dataclass(frozen=True)
class _End:
    """The robot's end of a wire, and a factory of our end."""

    poll: Callable[[float], None]
    make: Callable[[], Link]


def run_fault(
    wire_name: str, fault: Fault, loss: str, key: Key, symbols: tuple[int, ...], *, seed: int, folder: Path
) -> FaultRun:
    """The record of one run; `loss` is "", "cut" or "swallowed", and the journal is written into `folder`."""
    clock = SimulatedClock()
    wire, plant = FaultyWire(clock, seed), _ImpairedPlant(seed)
    end = _end(wire_name, wire, plant, clock)
    link = ReconnectingLink(end.make, clock)
    motion: list[tuple[float, float, float]] = []

    def poll(now_s: float) -> None:
        end.poll(now_s)
        motion.append((*plant.position_xy_m, plant.heading_rad))

    path = folder / "robot0.csv"
    with Journal(path, _header(key, symbols), threaded=False) as journal:
        ticks = _Ticks(key, symbols, link, journal, plant, seed)
        clock.every(SAMPLE_PERIOD_S, poll)
        clock.every(link.service_period_s, _not_reentrant(link.service))
        link.open()
        clock.every(1.0 / key.scheme.rate_hz, ticks.tick, START_S)
        clock.sleep_until(FAULT_S)
        wire.faults, plant.fault = fault.wire, fault
        clock.sleep_until(LOST_S)
        if loss == "cut":
            wire.cut()
        wire.swallows = loss == "swallowed"
        clock.sleep_until(FOUND_S)
        wire.restore()
        clock.sleep_until(END_S)
        ticks.end()
        commands = tuple(plant.commands)
        # A link that is blocked or lost at the end raises because it cannot send the stop.
        with suppress(MtmError):
            link.stop()
        link.close()
    return FaultRun(commands, np.array(motion), read_journal(path), link.losses)


class _Ticks:
    """The onboard program: the runtime, and a controller whose base commands end at `SILENT_S`."""

    def __init__(
        self, key: Key, symbols: tuple[int, ...], link: Link, journal: Journal, plant: MecanumPlant, seed: int
    ) -> None:
        channel, rate_hz = key.scheme.channels[0], key.scheme.rate_hz
        self._source = HeldSource()
        guard = Guard(LIMITS, Staleness(), noise_sigma=body_sigmas([channel]), period_s=1.0 / rate_hz)
        modulator = Modulator(key.codebook(), channel.name, symbols)
        self._runtime = Runtime(modulator, guard, self._source, link, journal)
        self._task = TASKS["orbit"](Route((0.0, 0.0), ()), seed)
        self._plant = plant
        self._rate_hz = rate_hz
        self._is_over = False

    def tick(self, now_s: float) -> None:
        if self._is_over:
            return
        if now_s < SILENT_S:
            self._source.set(self._task.command(self._plant.position_xy_m, self._plant.heading_rad), now_s)
        self._runtime.step(round((now_s - START_S) * self._rate_hz), now_s)

    def end(self) -> None:
        self._is_over = True


def _header(key: Key, symbols: tuple[int, ...]) -> JournalHeader:
    scheme = key.scheme
    return JournalHeader(
        fingerprint=scheme.fingerprint,
        key_id=key.id,
        robot="robot0",
        channel=scheme.channels[0].name,
        symbols=symbols,
        repeat=True,
        rate_hz=scheme.rate_hz,
        start_s=START_S,
        start_unix_s=None,
    )


def _not_reentrant(service: Callable[[float], None]) -> Callable[[float], None]:
    """The service without reentrance, as in a single thread."""
    is_busy = False

    def serve(now_s: float) -> None:
        nonlocal is_busy
        if not is_busy:
            is_busy = True
            try:
                service(now_s)
            finally:
                is_busy = False

    return serve


def _end(name: str, wire: FaultyWire, plant: MecanumPlant, clock: SimulatedClock) -> _End:
    if name == "can":
        node = CanMotionController(MotionController(plant, DEADMEN_S[name]), FaultyBus(wire, is_robot=True))
        return _End(node.poll, lambda: RoboMasterCan(FaultyBus(wire, is_robot=False), clock=clock))
    if name == "plaintext":
        server = PlaintextMotionController(MotionController(plant, DEADMEN_S[name]), [FaultyTextPort(wire)])
        return _End(server.poll, lambda: LineLink(FaultyText(wire)))
    vehicle = MavlinkVehicle(COPTER, plant, FaultyPort(wire, is_robot=True), is_guided=True, is_armed=True)
    return _End(
        vehicle.poll,
        lambda: MavlinkLink(profile="copter", clock=clock, open_port=lambda: FaultyPort(wire, is_robot=False)),
    )
