"""A run in simulated time: the onboard runtime of every robot, its wire and its plant, in lockstep."""

from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import numpy as np

from hil.fleet.clock import AnsweringClock, SimulatedClock
from hil.fleet.direct import DirectLink
from hil.fleet.rig import LIMITS, SAMPLE_PERIOD_S, RobotReport, RunResult, RunSettings, Wire, seeds_of
from hil.sensors.poses import Floats, Trajectory
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.mavlink_firmware import COPTER
from hil.vehicles.mavlink_vehicle import MavlinkVehicle
from hil.vehicles.motion_controller import MotionController, Plant
from hil.vehicles.plaintext_node import PlaintextMotionController
from hil.wires.byte_pipe import PipeEnd, byte_pipe
from hil.wires.can_line import can_line
from hil.wires.plaintext_line import plaintext_line
from hil.worlds.robomaster import Route, Task, routes
from mtm_onboard.links.base import Link
from mtm_onboard.links.mavlink import MavlinkLink
from mtm_onboard.links.robomaster_can import RoboMasterCan
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import Channel
from mtm_onboard.protocol.framing import channel_symbols
from mtm_onboard.runtime.guard import Guard, Staleness, body_sigmas
from mtm_onboard.runtime.loop import LoopStats, run_loop
from mtm_onboard.runtime.message import Message
from mtm_onboard.runtime.source import HeldSource
from mtm_onboard.runtime.tick import NoiseAdder, Runtime

# After the last stop, so that it has crossed the wire.
_SETTLING_S = 0.05


@dataclass(frozen=True)
class _Link:
    """The wire to one robot: our transport, the robot's periodic `poll`, the count of `faults`, and `shutdown`.

    `stop_releases_motors` says whether a stop over this wire switches the motors off as well.
    """

    transport: Link
    poll: Callable[[float], None]
    faults: Callable[[], int]
    shutdown: Callable[[], None]
    stop_releases_motors: bool = True


class _Adders:
    """The noise of several channels of one body, one added to the other."""

    def __init__(self, adders: Sequence[NoiseAdder]) -> None:
        self._adders = adders

    def require_body_axes(self) -> None:
        for adder in self._adders:
            adder.require_body_axes()

    def add(self, tick: int, base: BodyVelocity) -> BodyVelocity:
        for adder in self._adders:
            base = adder.add(tick, base)
        return base

    def prepare(self, tick: int) -> None:
        for adder in self._adders:
            adder.prepare(tick)


@dataclass(frozen=True, kw_only=True)
class _Robot:
    name: str
    plant: Plant
    controller: MotionController
    link: _Link
    task: Task
    source: HeldSource
    guard: Guard
    runtime: Runtime

    def step(self, tick: int, now_s: float) -> None:
        """Command the base velocity for the present pose, then run the onboard tick."""
        self.source.set(self.task.command(self.plant.position_xy_m, self.plant.heading_rad), now_s)
        self.runtime.step(tick, now_s)

    def report(self, stats: LoopStats) -> RobotReport:
        guard, controller = self.guard, self.controller
        is_stopped = controller.demand == STOP and not (self.link.stop_releases_motors and controller.work_mode)
        return RobotReport(
            name=self.name,
            sent=stats.sent,
            missed=stats.missed,
            clamped=guard.clamped,
            stale=guard.stale,
            refused=guard.refused,
            faults=self.link.faults(),
            deadman_stops=controller.deadman_stops,
            is_stopped=is_stopped,
        )


def run_lockstep(settings: RunSettings) -> RunResult:
    """The motion of a run of the world.

    The same settings give the same result, bit for bit, over CAN and without a wire. In plaintext commands are rounded
    to 0.1 mm/s and 0.001 deg/s; over MAVLink the first one waits for the vehicle's first message. Raises MtmError when
    a robot's link fails.
    """
    clock = SimulatedClock()
    with ExitStack() as wires:
        robots = _robots(settings, clock)
        for robot in robots:
            wires.callback(robot.link.shutdown)
        return _run(settings, clock, robots)


def _run(settings: RunSettings, clock: SimulatedClock, robots: list[_Robot]) -> RunResult:
    poses = array("d")
    polls = [(robot.link.poll, robot.plant) for robot in robots]

    def poll(now_s: float) -> None:
        for poll_one, plant in polls:
            poll_one(now_s)
            x_m, y_m = plant.position_xy_m
            poses.extend((x_m, y_m, plant.heading_rad))

    def step(tick: int, now_s: float, _late_s: float) -> None:
        for robot in robots:
            robot.step(tick, now_s)

    clock.every(SAMPLE_PERIOD_S, poll)
    with _opened([robot.link.transport for robot in robots], clock):
        stats = _loop(settings, clock, step)
        clock.sleep_until(settings.seconds)
        samples = len(poses)
    clock.sleep_until(settings.seconds + _SETTLING_S)
    motion = np.frombuffer(poses[:samples], dtype=np.float64).reshape(-1, len(robots), 3)
    return RunResult(
        _trajectories(settings.names, motion), settings.onset_s, tuple(robot.report(stats) for robot in robots)
    )


def _loop(settings: RunSettings, clock: SimulatedClock, step: Callable[[int, float, float], None]) -> LoopStats:
    # A tick that falls on the very end would have no motion to show.
    end_s = settings.seconds - 1e-6
    return run_loop(
        clock, settings.key.scheme.rate_hz, step, start_s=settings.onset_s, stop=lambda: clock.now() >= end_s
    )


@contextmanager
def _opened(transports: list[Link], clock: SimulatedClock) -> Iterator[None]:
    with ExitStack() as stack:
        for transport in transports:
            stack.enter_context(transport)
            if not isinstance(transport, DirectLink):
                clock.every(transport.service_period_s, transport.service)
        yield


def _robots(settings: RunSettings, clock: SimulatedClock) -> list[_Robot]:
    names, message = settings.names, settings.message()
    seeds = seeds_of(settings.seed, len(names))
    each = zip(names, seeds.slips, routes(seeds.permutation()), strict=True)
    return [_robot(settings, clock, name, message, slip_seed, route) for name, slip_seed, route in each]


def _robot(
    settings: RunSettings,
    clock: SimulatedClock,
    name: str,
    message: Message | None,
    slip_seed: int,
    route: Route,
) -> _Robot:
    plant = settings.new_chassis(slip_seed, route.start_xy_m)
    controller, link = _wired(settings.wire, plant, clock)
    source = HeldSource()
    period_s = 1.0 / settings.key.scheme.rate_hz
    channels = settings.channels(name)
    guard = Guard(LIMITS, Staleness(), noise_sigma=body_sigmas(channels), period_s=period_s)
    adders = [] if message is None else [_modulator(settings, channel, message) for channel in channels]
    modulator = adders[0] if len(adders) == 1 else _Adders(adders) if adders else None
    runtime = Runtime(modulator, guard, source, link.transport)
    return _Robot(
        name=name,
        plant=plant,
        controller=controller,
        link=link,
        task=settings.task(route, slip_seed),
        source=source,
        guard=guard,
        runtime=runtime,
    )


def _modulator(settings: RunSettings, channel: Channel, message: Message) -> NoiseAdder:
    codebook, scheme = settings.key.codebook(settings.first_slot), settings.key.scheme
    if settings.payload is not None and scheme.schedule == "rolling":
        return settings.modulator(codebook, channel.name, message)
    own = channel_symbols(message.symbols(settings.first_slot), scheme)[channel.name]
    return settings.modulator(codebook, channel.name, own)


def _wired(wire: Wire, plant: Plant, clock: SimulatedClock) -> tuple[MotionController, _Link]:
    if wire == "plaintext":
        controller = MotionController(plant, deadman_s=None)  # as the robot has none on this wire
        return controller, _plaintext_link(controller)
    if wire == "mavlink":
        ours, theirs = byte_pipe()
        vehicle = MavlinkVehicle(COPTER, plant, theirs, is_guided=True, is_armed=True)
        return vehicle.controller, _mavlink_link(vehicle, ours, clock)
    controller = MotionController(plant)
    return controller, _can_link(controller, clock) if wire == "can" else _direct_link(controller, clock)


def _can_link(controller: MotionController, clock: SimulatedClock) -> _Link:
    ours, theirs = can_line()
    node = CanMotionController(controller, theirs)
    transport = RoboMasterCan(ours, clock=AnsweringClock(clock, node.poll))

    def faults() -> int:
        wrong = node.faults + node.ignored_messages + node.malformed_messages + node.bus_errors
        return (
            wrong + transport.bus_errors + transport.refusals + transport.malformed_pushes + transport.missed_heartbeats
        )

    return _Link(transport, node.poll, faults, node.shutdown)


def _plaintext_link(controller: MotionController) -> _Link:
    transport, port = plaintext_line()
    node = PlaintextMotionController(controller, [port])

    def faults() -> int:
        return node.faults + controller.faults + transport.refusals + transport.malformed + transport.link_errors

    return _Link(transport, node.poll, faults, node.shutdown)


def _mavlink_link(vehicle: MavlinkVehicle, ours: PipeEnd, clock: SimulatedClock) -> _Link:
    transport = MavlinkLink(profile="copter", clock=clock, open_port=lambda: ours)

    def faults() -> int:
        health = transport.health()
        wrong = sum(int(health[name]) for name in ("refusals", "alarms", "link_errors", "bad_frames", "malformed"))
        return wrong + vehicle.refused_frames + vehicle.ignored_setpoints + vehicle.controller.faults

    return _Link(transport, vehicle.poll, faults, lambda: None, stop_releases_motors=False)


def _direct_link(controller: MotionController, clock: SimulatedClock) -> _Link:
    return _Link(DirectLink(controller, clock), controller.advance, lambda: controller.faults, lambda: None)


def _trajectories(names: Sequence[str], motion: Floats) -> tuple[Trajectory, ...]:
    """From poses (samples, robots, 3)."""
    times_s: Floats = np.arange(len(motion), dtype=np.float64) * SAMPLE_PERIOD_S
    return tuple(
        Trajectory(name, times_s, motion[:, robot, :2], motion[:, robot, 2]) for robot, name in enumerate(names)
    )
