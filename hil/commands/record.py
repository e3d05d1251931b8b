"""`mtm-hil record`: drive the simulated robots and record them."""

import math
import time
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from hil.commands.new_folder import check_new, new_folder
from hil.fleet.chassis import chassis_of
from hil.fleet.lockstep import run_lockstep
from hil.fleet.realtime import START_S, run_realtime
from hil.fleet.recording import Sensors, write_recording
from hil.fleet.rig import RobotReport, RunSettings, Wire
from hil.plants.family import ROBOMASTER
from hil.sensors.camera_motion import CameraMotion
from hil.sensors.cameras import CAMERAS, FLOORS
from hil.sensors.film_qualities import FILM_QUALITIES
from hil.worlds.robomaster import MOST_ROBOTS, ROBOTS, tagged_scheme
from hil.worlds.vehicles import arena_task, vehicle
from mtm_onboard.protocol import Key, Scheme, generate_key, load_key, save_key
from mtm_onboard.protocol.disclosure import load_anchor, load_disclosed
from mtm_onboard.protocol.errors import WrongValueError
from mtm_onboard.protocol.public_channel import link_to_carry, public_key
from mtm_onboard.protocol.slots import next_slot, slot_start_unix_s
from mtm_onboard.runtime.message import Content, message_of

KEY_NAME = "robot.key"
# Where nothing is asked for: two of the paper's messages, and room for text that is short.
_USUAL_S, _TAIL_S, _USUAL_BYTES = 26.0, 0.5, 8
# From the start of the recording to the message's, in simulated time.
LEAD_S = 1.5


@dataclass(frozen=True, kw_only=True)
class RecordOptions:
    """What the command line asked for.

    `content` None moves the robots without a message, `seconds` None is as long as one message takes, `robots` None as
    many as the key has bodies, `key` None makes a key, `camera` None films nothing, `quality` None keeps the film
    nearly as the camera saw it, and `plant` is the kind of the robots. `realtime` runs the onboard programs on UARTs
    when `wire` is plaintext, over UDP when it is MAVLink and on serial CAN adapters otherwise. `motion` None is a
    camera on a stand; `floor` is one of `FLOORS`. `carried` is the public channel's key and the disclosed one that it
    plays, in the place of `key` and `content`.
    """

    out: Path
    seconds: float | None
    content: Content | None
    key: Path | None
    wire: Wire
    seed: int
    camera: str | None
    realtime: bool
    quality: str | None = None
    motion: CameraMotion | None = None
    floor: str = "mat"
    plant: str = ROBOMASTER
    robots: int | None = None
    carried: tuple[Key, bytes] | None = None


def carried(anchor: Path, disclosed: Path) -> tuple[Key, bytes]:
    """What robots play who carry a disclosed key; raises MtmError when it may not be public yet, or is none."""
    chain = load_anchor(anchor)
    return public_key(chain), link_to_carry(chain, load_disclosed(disclosed, chain), datetime.now(UTC))


def record(options: RecordOptions, console: Console) -> None:
    """Write the recording folder, whole or not at all; raises MtmError when it exists or an option does not fit."""
    check_new(options.out)
    if options.carried is not None:
        options = replace(options, content=options.carried[1])
    work, chassis = arena_task(options.plant), chassis_of(options.plant)
    key = _key(options)
    sensors = Sensors(
        camera=None if options.camera is None else replace(CAMERAS[options.camera], motion=options.motion),
        quality=None if options.quality is None else FILM_QUALITIES[options.quality],
        scene=FLOORS[options.floor],
    )
    start_s = START_S if options.realtime else LEAD_S
    settings = RunSettings(
        key=key,
        symbols=_symbols(options.content, key),
        seconds=_seconds(options.seconds, start_s, key.scheme),
        seed=options.seed,
        wire=options.wire,
        start_s=start_s,
        payload=options.content if key.scheme.framing is not None and not isinstance(options.content, tuple) else None,
        unix_s=None if options.realtime else _began_unix_s(key.scheme, start_s),
        task=work,
        chassis=chassis,
        robots=options.robots,
    )
    with new_folder(options.out) as folder:
        if _makes_key(options):
            save_key(key, folder / KEY_NAME)
        if options.realtime:
            (folder / "onboard").mkdir()
            result = run_realtime(settings, options.key or folder / KEY_NAME, folder / "onboard")
        else:
            result = run_lockstep(settings)
        frames = 0 if sensors.camera is None else int(settings.seconds * sensors.camera.rate_hz)
        with Progress(console=console, transient=True, disable=not (frames and console.is_terminal)) as progress:
            task = progress.add_task("filming", total=frames)
            write_recording(folder, settings, result, sensors, lambda done: progress.update(task, completed=done))
    _print_summary(options, settings)
    if options.realtime:
        console.print(_robots_table(result.robots))


def _makes_key(options: RecordOptions) -> bool:
    return options.key is None and options.carried is None


def _key(options: RecordOptions) -> Key:
    if options.carried is not None:
        return options.carried[0]
    return generate_key("hil", _scheme(options)) if options.key is None else load_key(options.key)


def _scheme(options: RecordOptions) -> Scheme:
    """A scheme like the key generator's preset, for these robots, their axes and what they are to say."""
    content, robots = options.content, ROBOTS if options.robots is None else options.robots
    if robots > MOST_ROBOTS:
        raise WrongValueError(f"{robots} robots do not fit into the arena; it holds {MOST_ROBOTS}")
    usual = tagged_scheme(robots)
    if isinstance(content, str | bytes):
        size = len(content.encode() if isinstance(content, str) else content)
        usual = tagged_scheme(robots, "text" if isinstance(content, str) else "bytes", 8 * max(_USUAL_BYTES, size))
    axes = vehicle(options.plant).kind.axes
    return replace(usual, channels=tuple(replace(channel, axes=axes) for channel in usual.channels))


def _symbols(content: Content | None, key: Key) -> tuple[int, ...] | None:
    """The whole message where the key's scheme frames none; raises MtmError for what it does not carry."""
    if content is None or key.scheme.framing is not None:
        return None
    return message_of(content, key).symbols(0)


def _seconds(asked: float | None, start_s: float, scheme: Scheme) -> float:
    """As asked, else two of the paper's messages, or one of the scheme's where that takes longer."""
    needed_s = start_s + scheme.message_ticks / scheme.rate_hz + _TAIL_S
    return max(_USUAL_S, needed_s) if asked is None else asked


def _began_unix_s(scheme: Scheme, start_s: float) -> float | None:
    """Now, or a little later, so that a message slot begins when the message does; None where there are no slots."""
    if scheme.schedule != "rolling":
        return None
    return slot_start_unix_s(next_slot(time.time() + start_s, scheme), scheme) - start_s


def _print_summary(options: RecordOptions, settings: RunSettings) -> None:
    message = settings.message()
    sent = "no message" if message is None else f"{_said(options.content)}, from {settings.onset_s:.4g} s on"
    count = len(settings.names)
    robots = f"{count} robot" if count == 1 else f"{count} robots"
    print(f"{options.out}: {robots}, {settings.seconds:g} s of motion, {sent}")
    scheme = settings.key.scheme
    axes = vehicle(options.plant).kind.follows
    played = dict.fromkeys(axis for channel in scheme.channels for axis in channel.axes)
    if message is not None and not played.keys() <= set(axes):
        print(f"the key's noise is on {', '.join(played)}; {options.plant} carries it on {', '.join(axes)}")
    silent = [channel.name for channel in scheme.channels if channel not in settings.channels(channel.body)]
    if message is not None and silent:
        print(f"the key does not hold {', '.join(silent)}, whose part is not sent")
    if settings.unix_s is not None:
        began = datetime.fromtimestamp(settings.unix_s, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        print(f"it began at {began}; decode it with --at {began} --at-error 1")
    whole_s = settings.onset_s + scheme.message_ticks / scheme.rate_hz
    if message is not None and settings.seconds < whole_s:
        print(f"the message is cut off; it takes --seconds {math.ceil(10.0 * whole_s) / 10.0:g} to record it once")
    if _makes_key(options):
        print(f"the key is {options.out / KEY_NAME}; keep it secret")


def _said(content: Content | None) -> str:
    return f"message {content}" if isinstance(content, int) else f"message {content!r}"


def _robots_table(robots: tuple[RobotReport, ...]) -> Table:
    table = Table(title="ticks of each robot, and how late they began", box=None)
    for name in ("", "sent", "missed", "clamped", "stale", "refused", "faults", "p50 ms", "p99 ms"):
        table.add_column(name, justify="right")
    for robot in robots:
        counts = (robot.sent, robot.missed, robot.clamped, robot.stale, robot.refused, robot.faults)
        table.add_row(robot.name, *map(str, counts), *(f"{1e3 * late_s:.2f}" for late_s in robot.late_s))
    return table
