"""`mtm-hil record`: drive the simulated robots and record them."""

import time
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from hil.commands.new_folder import check_new, new_folder
from hil.fleet.lockstep import run_lockstep
from hil.fleet.realtime import START_S, run_realtime
from hil.fleet.recording import Sensors, write_recording
from hil.fleet.rig import ChassisFactory, RobotReport, RunSettings, Wire
from hil.plants.family import ROBOMASTER
from hil.plants.robots import SteppedRobot
from hil.sensors.camera_motion import CameraMotion
from hil.sensors.cameras import CAMERAS, FLOORS
from hil.sensors.film_qualities import FILM_QUALITIES
from hil.worlds.robomaster import fleet_scheme
from hil.worlds.vehicles import arena_task, vehicle
from mtm_onboard.protocol import Scheme, generate_key, load_key, save_key
from mtm_onboard.protocol.framing import symbols_of_number

KEY_NAME = "robot.key"
_STREAM = 731
# From the start of the recording to the message's, in simulated time.
LEAD_S = 1.5


@dataclass(frozen=True, kw_only=True)
class RecordOptions:
    """What the command line asked for.

    `message` None moves the robots without one, `key` None makes a key, `camera` None films nothing, `quality` None
    keeps the film nearly as the camera saw it, and `plant` is the kind of the robots. `realtime` runs
    the onboard programs on UARTs when `wire` is plaintext, over UDP when it is MAVLink and on serial CAN adapters
    otherwise. `motion` None is a camera on a stand; `floor` is one of `FLOORS`.
    """

    out: Path
    seconds: float
    message: int | None
    key: Path | None
    wire: Wire
    seed: int
    camera: str | None
    realtime: bool
    quality: str | None = None
    motion: CameraMotion | None = None
    floor: str = "mat"
    plant: str = ROBOMASTER


def record(options: RecordOptions, console: Console) -> None:
    """Write the recording folder, whole or not at all; raises MtmError when it exists or an option does not fit."""
    check_new(options.out)
    work, chassis = arena_task(options.plant), _chassis(options.plant)
    key = generate_key("hil", _scheme(options.plant)) if options.key is None else load_key(options.key)
    framed = key.scheme.framing is not None
    symbols = None if options.message is None or framed else symbols_of_number(options.message, key.scheme)
    sensors = Sensors(
        camera=None if options.camera is None else replace(CAMERAS[options.camera], motion=options.motion),
        quality=None if options.quality is None else FILM_QUALITIES[options.quality],
        scene=FLOORS[options.floor],
    )
    settings = RunSettings(
        key=key,
        symbols=symbols,
        seconds=options.seconds,
        seed=options.seed,
        wire=options.wire,
        start_s=START_S if options.realtime else LEAD_S,
        payload=options.message if framed else None,
        # A rolling schedule needs a time of day, and a recording made now has this one.
        unix_s=time.time() if key.scheme.schedule == "rolling" and not options.realtime else None,
        task=work,
        chassis=chassis,
    )
    with new_folder(options.out) as folder:
        if options.key is None:
            save_key(key, folder / KEY_NAME)
        if options.realtime:
            (folder / "onboard").mkdir()
            result = run_realtime(settings, options.key or folder / KEY_NAME, folder / "onboard")
        else:
            result = run_lockstep(settings)
        frames = 0 if sensors.camera is None else int(options.seconds * sensors.camera.rate_hz)
        with Progress(console=console, transient=True, disable=not (frames and console.is_terminal)) as progress:
            task = progress.add_task("filming", total=frames)
            write_recording(folder, settings, result, sensors, lambda done: progress.update(task, completed=done))
    _print_summary(options, settings)
    if options.realtime:
        console.print(_robots_table(result.robots))


def _scheme(plant: str) -> Scheme:
    """The fleet's scheme, its noise on the axes of that kind of robot."""
    usual, axes = fleet_scheme(), vehicle(plant).kind.axes
    return replace(usual, channels=tuple(replace(channel, axes=axes) for channel in usual.channels))


def _chassis(plant: str) -> ChassisFactory | None:
    """Robots of the kind, each drawn from its own seed; None for the calibrated one, which is the rig's own."""
    if plant == ROBOMASTER:
        return None
    kind = vehicle(plant).kind
    return lambda seed, place: SteppedRobot(kind.draw(np.random.default_rng([_STREAM, seed])), seed, place)


def _print_summary(options: RecordOptions, settings: RunSettings) -> None:
    sent = "no message" if options.message is None else f"message {options.message}, from {settings.onset_s:.4g} s on"
    print(f"{options.out}: {options.seconds:g} s of motion, {sent}")
    scheme = settings.key.scheme
    axes = vehicle(options.plant).kind.axes
    if options.message is not None and scheme.channels[0].axes != axes:
        print(f"the key's noise is on {', '.join(scheme.channels[0].axes)}; {options.plant} carries it on "
              f"{', '.join(axes)}")  # fmt: skip
    if settings.unix_s is not None:
        began = datetime.fromtimestamp(settings.unix_s, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        print(f"it began at {began}; decode it with --at {began} --at-error 1")
    whole_s = settings.onset_s + scheme.message_ticks / scheme.rate_hz
    if options.message is not None and options.seconds < whole_s:
        print(f"the message is cut off; it takes --seconds {whole_s:g} to record it once")
    if options.key is None:
        print(f"the key is {options.out / KEY_NAME}; keep it secret")


def _robots_table(robots: tuple[RobotReport, ...]) -> Table:
    table = Table(title="ticks of each robot, and how late they began", box=None)
    for name in ("", "sent", "missed", "clamped", "stale", "refused", "faults", "p50 ms", "p99 ms"):
        table.add_column(name, justify="right")
    for robot in robots:
        counts = (robot.sent, robot.missed, robot.clamped, robot.stale, robot.refused, robot.faults)
        table.add_row(robot.name, *map(str, counts), *(f"{1e3 * late_s:.2f}" for late_s in robot.late_s))
    return table
