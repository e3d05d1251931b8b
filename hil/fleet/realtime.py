"""A run in real time: every robot's onboard runtime in a process of its own, the simulated robots in this one.

The onboard programs meet serial devices and a UDP port, as on a robot, and start their message at a common
instant. This process is the robots' motion controllers, the chassis, and the controller that sends base commands.
"""

import time
from array import array
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hil.fleet.onboard_process import OnboardProcess
from hil.fleet.rig import SAMPLE_PERIOD_S, RunResult, RunSettings, seeds_of
from hil.fleet.serial_wires import serial_wire
from hil.sensors.poses import Trajectory
from hil.vehicles.motion_controller import Plant
from hil.worlds.robomaster import Task, routes
from mtm_onboard.model.clock import SystemClock
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.slots import next_slot, slot_start_unix_s
from mtm_onboard.runtime.client import BaseCommandClient
from mtm_onboard.runtime.loop import run_loop

# Time for four interpreters to start before the message does.
START_S = 4.0

_POLLS_PER_COMMAND = 2
_POLLS_PER_CHECK = 100
_SHUTDOWN_TIMEOUT_S = 3.0
# The programs' clock and this one may differ by adjustments of the system's time.
_CLOCK_TOLERANCE_S = 0.5


@dataclass
class _Robot:
    """One simulated robot, its task controller, and the program that drives it."""

    poll: Callable[[float], None]
    plant: Plant
    task: Task
    process: OnboardProcess
    client: BaseCommandClient

    def command(self) -> None:
        self.client.send(self.task.command(self.plant.position_xy_m, self.plant.heading_rad))


def run_realtime(settings: RunSettings, key_file: Path, folder: Path) -> RunResult:
    """Run for `settings.seconds` of real time; configurations, journals and outputs of the programs go to `folder`.

    `key_file` holds `settings.key`; the wire is a UART in plaintext or a serial CAN adapter. Raises MtmError when
    a program fails, starts too late or sends a tick twice.
    """
    clock = SystemClock()
    with ExitStack() as stack:
        began_s, start_unix_s = clock.now(), time.time() + settings.start_s
        settings, start_unix_s = _aligned(settings, start_unix_s)
        robots = _robots(settings, _arguments(settings, key_file, start_unix_s), folder, stack)
        motion, times_s = _drive(settings, clock, began_s, robots)
        for robot in robots:
            if robot.process.is_running:
                raise MtmError(f"mtm-onboard of {robot.process.name} did not end in time; run it again")
            robot.process.check(may_have_ended=True)
        reports = tuple(robot.process.report() for robot in robots)
    poses = np.frombuffer(motion, dtype=np.float64).reshape(-1, len(robots), 3)
    instants_s = np.frombuffer(times_s, dtype=np.float64)
    trajectories = tuple(
        Trajectory(robot.process.name, instants_s, poses[:, number, :2], poses[:, number, 2])
        for number, robot in enumerate(robots)
    )
    return RunResult(trajectories, settings.start_s, reports)


def _aligned(settings: RunSettings, start_unix_s: float) -> tuple[RunSettings, float]:
    """The same run and its message's start, later by what remains until a slot begins."""
    scheme = settings.key.scheme
    if scheme.schedule == "fixed":
        return settings, start_unix_s
    aligned_unix_s = slot_start_unix_s(next_slot(start_unix_s, scheme), scheme)
    later_s = aligned_unix_s - start_unix_s
    later = replace(settings, start_s=settings.start_s + later_s, seconds=settings.seconds + later_s)
    return later, aligned_unix_s


def _drive(
    settings: RunSettings, clock: SystemClock, began_s: float, robots: list[_Robot]
) -> "tuple[array[float], array[float]]":
    """Poll the robots until their programs have ended.

    Returns their poses up to the run's end, x, y and heading of each robot in turn, and the times of those.
    """
    poses, times_s = array("d"), array("d")
    last = -1

    def keep(time_s: float) -> None:
        times_s.append(time_s)
        for robot in robots:
            poses.extend((*robot.plant.position_xy_m, robot.plant.heading_rad))

    def step(tick: int, now_s: float, _late_s: float) -> None:
        nonlocal last
        since_s = now_s - began_s
        for robot in robots:
            robot.poll(since_s)
        if tick > 0 and tick * SAMPLE_PERIOD_S <= settings.seconds + 1e-6:
            # The chassis stands where its last whole step, that of this tick, has brought it.
            keep(tick * SAMPLE_PERIOD_S)
        if tick // _POLLS_PER_COMMAND > last // _POLLS_PER_COMMAND:
            for robot in robots:
                robot.command()
        if tick // _POLLS_PER_CHECK > last // _POLLS_PER_CHECK:
            for robot in robots:
                robot.process.check(may_have_ended=since_s > settings.seconds - _CLOCK_TOLERANCE_S)
        last = tick

    def ended() -> bool:
        after_s = clock.now() - began_s - settings.seconds
        return after_s > _SHUTDOWN_TIMEOUT_S or (
            after_s > 0.0 and not any(robot.process.is_running for robot in robots)
        )

    # The loop comes late to its first ticks, and a recording without its beginning would move the message's start.
    keep(0.0)
    run_loop(clock, 1.0 / SAMPLE_PERIOD_S, step, start_s=began_s, stop=ended)
    return poses, times_s


def _arguments(settings: RunSettings, key_file: Path, start_unix_s: float) -> list[str]:
    # Robots and recording are of one computer, so that its clock need not be right.
    lab = ["--allow-unsynchronised"] if settings.key.scheme.schedule == "rolling" else []
    return [
        *lab,
        "--key", str(key_file.resolve()), *_content(settings), "--start-at", f"{start_unix_s:.6f}",
        "--duration", f"{settings.seconds - settings.start_s:.6f}",
    ]  # fmt: skip


def _content(settings: RunSettings) -> list[str]:
    symbols, payload = settings.symbols, settings.payload
    if symbols is not None:
        return ["--symbols", ",".join(map(str, symbols))]
    if isinstance(payload, bytes):
        return ["--hex", payload.hex()]
    # A text may begin like an option, so it stands in one argument with its own.
    return ["--no-message"] if payload is None else [f"--{'text' if isinstance(payload, str) else 'message'}={payload}"]


def _robots(settings: RunSettings, arguments: list[str], folder: Path, stack: ExitStack) -> list[_Robot]:
    names = settings.names
    seeds = seeds_of(settings.seed, len(names))
    robots = []
    for name, slip, route in zip(names, seeds.slips, routes(seeds.permutation()), strict=True):
        channels = settings.channels(name)
        if len(channels) != 1:
            raise MtmError(
                f"in real time each robot plays one channel, and the key holds {len(channels)} of {name}; leave out "
                "--realtime"
            )
        channel = channels[0]
        plant = settings.new_chassis(slip, route.start_xy_m)
        wire = serial_wire(settings.wire, plant)
        stack.callback(wire.shutdown)
        process = OnboardProcess(folder, channel.body, channel.name, wire, arguments)
        stack.callback(process.end)
        client = BaseCommandClient(process.udp_port)
        stack.callback(client.close)
        robots.append(_Robot(wire.poll, plant, settings.task(route, slip), process, client))
    return robots
