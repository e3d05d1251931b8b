"""The command line: `mtm-audit <command>`. Exit codes: docs/command-line.md."""

import math
import os
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mtm_audit.commands.errors import reported
from mtm_audit.commands.force import Force
from mtm_audit.commands.manner import HELP_OPTIONS, version_option
from mtm_audit.commands.shared_options import takes_options_of

if TYPE_CHECKING:
    from mtm_audit.model.lens import Lens
    from mtm_audit.readers.logs.options import ReadOptions

app = typer.Typer(
    help="Find out what a robot said with its motion: from a recording and a key to a verdict.",
    no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None, context_settings=HELP_OPTIONS,
)  # fmt: skip

_TRACKER = "aruco"
_TRACKER_HELP = (
    "How to find robots in a video: aruco (default) or aruco:6x6_250, colour:NAME,..., centroid:COLOUR, brightness or "
    "brightness:X0,Y0,X1,Y1, arms:INNER,OUTER, football, or flow:X0,Y0,X1,Y1 (pixels from the upper left corner); "
    "see docs/filming.md."
)


_Camera = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="The calibration of a film's lens: ROS camera_info or OpenCV, YAML."),
]

# How to read a log; what they mean is in docs/formats.md.
_Topics = Annotated[
    list[str] | None,
    typer.Option("--topic", metavar="NAME", help="What to read of a log that holds several poses; may be repeated."),
]
_Bodies = Annotated[
    list[str] | None,
    typer.Option("--body", metavar="NAME=MARKER,...", help="The markers of a rigid body; may be repeated."),
]
_Unit = Annotated[str | None, typer.Option(metavar="UNIT", help="Unit of a log's positions: m, cm, mm, in or ft.")]
_TimeUnit = Annotated[str | None, typer.Option(metavar="UNIT", help="Unit of a log's times: s, ms, us or ns.")]
_Up = Annotated[str | None, typer.Option(metavar="AXIS", help="Axis of a log that points up: z, y, -y and so on.")]
_HeadingAxis = Annotated[
    str | None,
    typer.Option(
        metavar="AXIS",
        help="Axis of a log's bodies that points ahead: x, z, -y and so on (default: one that is level).",
    ),
]
_ArrivalTimes = Annotated[
    bool, typer.Option("--arrival-times", help="Take when messages were recorded, not the times that they carry.")
]


class StrategyName(StrEnum):
    """How channels are used; repeated from the planner so that --help need not load it."""

    SINGLE = "single"
    SAME = "same"
    SPLIT = "split"


@app.callback()
def _every_command(
    version: Annotated[bool, version_option("mtm-audit")] = False,
) -> None:
    pass


@app.command()
def decode(
    context: typer.Context,
    paths: Annotated[
        list[Path],
        typer.Argument(metavar="PATH", help="Videos, logs, motion-capture files, or a folder of those or of pictures."),
    ],
    key: Annotated[Path | None, typer.Option(metavar="FILE", help="The key file, unless --anchor is given.")] = None,
    anchor: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A fleet's public anchor: alone, to read its public channel (docs/keys.md)."),
    ] = None,
    disclosed: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="With --anchor: the disclosed key of the day on which the film was made."),
    ] = None,
    write_disclosed: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the disclosed key that the public channel carries, in a new file."),
    ] = None,
    onset: Annotated[
        str, typer.Option(metavar="SECONDS|auto", help="When the message begins, in the recording's own time.")
    ] = "auto",
    tracker: Annotated[str | None, typer.Option(metavar="NAME", help=_TRACKER_HELP)] = None,
    reference: Annotated[
        str,
        typer.Option(
            metavar="TRACK,...", help="Tracks that stand still, such as markers on the floor (default: found)."
        ),
    ] = "",
    camera: _Camera = None,
    assign: Annotated[
        list[str] | None, typer.Option(metavar="BODY=TRACK", help="Which track shows a body; may be repeated.")
    ] = None,
    frame_rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Pictures a second that the camera took, whatever the file says."),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(metavar="N", help="Play it N times as fast: 4 for slow motion of 120 shown at 30 a second."),
    ] = None,
    search_speed: Annotated[
        bool, typer.Option("--search-speed", help="Try common speeds from 1/8 to 8, which costs 3.9 bits.")
    ] = False,
    detector: Annotated[
        str, typer.Option(metavar="NAME", help="How to look for the noise: matched, or coherency as the paper does.")
    ] = "matched",
    decoys: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=8,
            max=10_000,
            help="Keys that nobody holds, to compare with: 40 for coherency, none for matched.",
        ),
    ] = None,
    threshold: Annotated[
        float,
        typer.Option(metavar="P", min=1e-300, max=1.0, help="How often a message that is called decoded may be wrong."),
    ] = 1e-4,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON (docs/decode-json.md) instead of a table.")
    ] = False,
    plot: Annotated[Path | None, typer.Option(metavar="FILE.png", help="Draw the decode (.png, .pdf, .svg).")] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE.html", help="Write a page to hand on (docs/report.md).")
    ] = None,
    force: Force = False,
    overlay: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.mp4", help="Draw what was seen and read over the film; FILE.png for one still of it."
        ),
    ] = None,
    sheet: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Draw twelve pictures of the film with what was seen.")
    ] = None,
    together: Annotated[
        bool,
        typer.Option("--together", help="All recordings show one message (docs/decoding.md)."),
    ] = False,
    explain: Annotated[bool, typer.Option("--explain", help="Say stage by stage what was found.")] = False,
    profile: Annotated[
        Path | None, typer.Option(metavar="FILE", help="What mtm-audit profile learnt about this type of robot.")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help="When the recording began (2026-01-31T12:00:00Z), for a rolling schedule.",
        ),
    ] = None,
    at_error: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=60.0,
            metavar="SECONDS",
            help="How far that time may be off; 2 when both clocks are synchronised.",
        ),
    ] = 30.0,
    topic: _Topics = None,
    body: _Bodies = None,
    unit: _Unit = None,
    time_unit: _TimeUnit = None,
    up: _Up = None,
    heading_axis: _HeadingAxis = None,
    arrival_times: _ArrivalTimes = False,
    revoked: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Key files no longer trusted, as mtm-onboard revoke lists them.")
    ] = None,
) -> None:
    """Decode the message in a recording.

    Exit codes: 0 decoded, 3 no message of this key, 4 inconclusive, 1 error, 2 usage, 130 interrupted.
    """  # fmt: skip
    if search_speed and speed is not None:
        raise typer.BadParameter("is given; leave it or --search-speed out", param_hint="--speed")
    if (key is None) == (anchor is None) or (disclosed is not None and anchor is None):
        raise typer.BadParameter("give a key file, or else an anchor with a disclosed key or alone", param_hint="--key")
    if write_disclosed is not None and (anchor is None or disclosed is not None):
        raise typer.BadParameter("is read on the public channel; give --anchor alone", param_hint="--write-disclosed")
    onset_s, pairs, times = _onset_s(onset), _pairs(assign or []), [] if at is None else at.split(",")
    began_unix_s = [_unix_s(text.strip()) for text in times]
    if len(began_unix_s) > 1 and not together:
        raise typer.BadParameter("is one time unless recordings are read --together", param_hint="--at")
    with reported("mtm-audit", "nothing was written"):
        from mtm_audit.commands.decode import DecodeOptions, run_decode
        from mtm_audit.commands.opened_key import KeySource
        from mtm_audit.decoding.settings import DecodeSettings
        from mtm_audit.detectors.matched.profile import load_profile
        from mtm_audit.model.recorded_at import RecordedAt
        from mtm_audit.reporting.overlay.files import overlay_files
        from mtm_audit.reporting.report.provenance import requested
        from mtm_onboard.protocol.revocation import RevocationList, load_revocations

        known = None if profile is None else load_profile(profile)
        began = [RecordedAt(unix_s, at_error) for unix_s in began_unix_s if unix_s is not None]
        settings = DecodeSettings(
            detector=detector, onset_s=onset_s, decoys=decoys, threshold=threshold, assignment=pairs, profile=known,
            at=began[0] if began else None,
            revoked=RevocationList() if revoked is None else load_revocations(revoked),
        )  # fmt: skip
        reading = _reading(topic, body, unit, time_unit, up, heading_axis, arrival_times=arrival_times)
        given = _given({
            "--tracker": tracker, "--reference": reference, "--camera": camera, "--frame-rate": frame_rate,
            "--topic": topic, "--body": body, "--unit": unit, "--time-unit": time_unit, "--up": up,
            "--heading-axis": heading_axis, "--arrival-times": arrival_times, "--at": at,
        })  # fmt: skip
        played = None if search_speed else 1.0 if speed is None else speed
        inputs = {
            "key": key, "anchor": anchor, "disclosed key": disclosed, "profile": profile, "revocations": revoked,
            "calibration": camera,
        }  # fmt: skip
        code = run_decode(
            DecodeOptions(
                paths=tuple(paths), source=KeySource(key, anchor, disclosed), tracker=tracker or _TRACKER,
                reference=_names(reference), settings=settings, as_json=as_json, plot=plot, explain=explain,
                reading=reading, frame_rate_hz=frame_rate, lens=_lens(camera), speed=played,
                overlay=overlay_files(overlay, sheet),
                report=None if report is None else requested(report, context.find_root().obj, inputs), force=force,
                together=together, each_at=tuple(began) if together else (), given=given,
                write_disclosed=write_disclosed,
            )
        )  # fmt: skip
    raise typer.Exit(code)


@app.command()
def look(
    paths: Annotated[
        list[Path],
        typer.Argument(metavar="PATH", help="Videos, logs, motion-capture files, or a folder of those or of pictures."),
    ],
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="Draw a picture of the film with pixel numbers and what was found."),
    ] = None,
    force: Force = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON (docs/look.md) instead of text.")] = False,
    frame_rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", help="Pictures a second that the camera took, whatever the file says."),
    ] = None,
    topic: _Topics = None,
    body: _Bodies = None,
    unit: _Unit = None,
    time_unit: _TimeUnit = None,
    up: _Up = None,
    heading_axis: _HeadingAxis = None,
    arrival_times: _ArrivalTimes = False,
) -> None:
    """Say what is in a recording, without a key: markers, colours, motion, times, and how to decode it.

    Exit codes: 0 looked at, 1 error, 2 usage, 130 interrupted.
    """  # fmt: skip
    with reported("mtm-audit", "nothing was written"):
        from mtm_audit.commands.look import LookOptions, run_look

        reading = _reading(topic, body, unit, time_unit, up, heading_axis, arrival_times=arrival_times)
        code = run_look(
            LookOptions(
                paths=tuple(paths), picture=picture, as_json=as_json, frame_rate_hz=frame_rate, reading=reading,
                force=force,
            )
        )  # fmt: skip
    raise typer.Exit(code)


@app.command()
@takes_options_of(decode, "reference", "camera", "assign", "threshold", "profile", "revoked")
def watch(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="A camera (/dev/video0), a stream (rtsp://, http://, tcp://), a file that grows, or poses at "
            "udp://HOST:PORT.",
        ),
    ],
    *,
    key: Annotated[Path, typer.Option(metavar="FILE", help="The key file.")],
    tracker: Annotated[
        str, typer.Option(metavar="NAME", help="How to find robots: aruco[:6x6_250], colour:NAME,... or centroid:NAME.")
    ] = "aruco",
    seconds: Annotated[
        float | None, typer.Option(metavar="N", min=0.1, help="End after so long (default: at the verdict alone).")
    ] = None,
    page: Annotated[
        int | None,
        typer.Option(
            metavar="PORT", min=0, max=65_535, help="Serve a page to browsers on this machine; 0 takes a free port."
        ),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="Keep what was seen in this folder, which must not exist; decode reads it."
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="When a file was begun (2026-01-31T12:00:00Z), for a rolling schedule."),
    ] = None,
    at_error: Annotated[
        float,
        typer.Option(min=0.0, max=60.0, metavar="SECONDS", help="How far this machine's clock and the source are off."),
    ] = 10.0,
    **shared: Any,
) -> None:
    """Watch a camera, a stream or poses, and stop when a message is decoded (docs/watch.md).

    Exit codes: 0 decoded, 3 no message of this key, 4 inconclusive, 1 error, 2 usage. Ctrl-C ends with the best answer
    so far.
    """  # fmt: skip
    pairs, at_unix_s = _pairs(shared["assign"] or []), _unix_s(at)
    with reported("mtm-audit", "nothing was decoded"):
        from mtm_audit.commands.opened_key import KeySource
        from mtm_audit.commands.watch import WatchOptions, run_watch
        from mtm_audit.decoding.settings import DecodeSettings
        from mtm_audit.detectors.matched.profile import load_profile
        from mtm_onboard.protocol.revocation import RevocationList, load_revocations

        settings = DecodeSettings(
            threshold=shared["threshold"], assignment=pairs,
            profile=None if shared["profile"] is None else load_profile(shared["profile"]),
            revoked=RevocationList() if shared["revoked"] is None else load_revocations(shared["revoked"]),
        )  # fmt: skip
        code = run_watch(
            WatchOptions(
                source=source, key=KeySource(key), tracker=tracker,
                reference=_names(shared["reference"]), settings=settings,
                at_unix_s=at_unix_s, at_error_s=at_error, seconds=seconds, page=page, record=record,
                lens=_lens(shared["camera"]),
            )
        )  # fmt: skip
    raise typer.Exit(code)


@app.command()
@takes_options_of(
    decode,
    "onset",
    "tracker",
    "reference",
    "camera",
    "assign",
    "frame_rate",
    "speed",
    "search_speed",
    "detector",
    "decoys",
    "threshold",
    "profile",
    "at",
    "at_error",
    "topic",
    "body",
    "unit",
    "time_unit",
    "up",
    "heading_axis",
    "arrival_times",
    "revoked",
)
def batch(
    paths: Annotated[
        list[Path], typer.Argument(metavar="PATH", help="Recordings, and folders that hold any (docs/batch.md).")
    ],
    *,
    key: Annotated[list[Path], typer.Option(metavar="FILE", help="A key file; may be repeated, which is paid for.")],
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="The table to write, a row for each recording.")],
    jobs: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Recordings read at once (default: one a core).")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="A Dask cluster to work on, such as tcp://192.168.0.2:8786."),
    ] = None,
    cache: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Where tracks are kept for the next key (default: ~/.cache/mtm/tracks)."),
    ] = None,
    force: Annotated[
        bool,
        typer.Option("--force", help="Replace any table or other file, whatever it holds; a key file never is."),
    ] = False,
    **shared: Any,
) -> None:
    """Decode many recordings into one table; a run that was stopped goes on when it is started again.

    Exit codes: 0 all were read, whatever they say, 1 error, or some could not be read, 2 usage, 130 interrupted.
    """  # fmt: skip
    if scheduler is not None and jobs is not None:
        raise typer.BadParameter("the cluster's workers decide that; leave it or --scheduler out", param_hint="--jobs")
    if shared["search_speed"] and shared["speed"] is not None:
        raise typer.BadParameter("is given; leave it or --search-speed out", param_hint="--speed")
    onset_s, pairs, at_unix_s = _onset_s(shared["onset"]), _pairs(shared["assign"] or []), _unix_s(shared["at"])
    with reported("mtm-audit", f"what is finished is in {out}, and the same command goes on from there"):
        from mtm_audit.batch.plan import Plan, named_keys
        from mtm_audit.commands.batch import BatchOptions, run_batch_command
        from mtm_audit.decoding.settings import DecodeSettings
        from mtm_audit.detectors.matched.profile import load_profile
        from mtm_audit.model.recorded_at import RecordedAt
        from mtm_onboard.protocol.revocation import RevocationList, load_revocations

        revoked = RevocationList() if shared["revoked"] is None else load_revocations(shared["revoked"])
        settings = DecodeSettings(
            detector=shared["detector"], onset_s=onset_s, decoys=shared["decoys"], threshold=shared["threshold"],
            assignment=pairs, profile=None if shared["profile"] is None else load_profile(shared["profile"]),
            at=None if at_unix_s is None else RecordedAt(at_unix_s, shared["at_error"]), revoked=revoked,
        )  # fmt: skip
        reading = _reading(
            shared["topic"], shared["body"], shared["unit"], shared["time_unit"], shared["up"],
            shared["heading_axis"], arrival_times=shared["arrival_times"],
        )  # fmt: skip
        speed = None if shared["search_speed"] else 1.0 if shared["speed"] is None else shared["speed"]
        plan = Plan(
            keys=named_keys(key, revoked), settings=settings, tracker=shared["tracker"] or _TRACKER,
            reference=_names(shared["reference"]), reading=reading, frame_rate_hz=shared["frame_rate"], speed=speed,
            lens=_lens(shared["camera"]), cache=None if cache is None else cache.absolute(),
        )  # fmt: skip
        code = run_batch_command(
            BatchOptions(paths=tuple(paths), plan=plan, out=out, jobs=jobs, scheduler=scheduler, force=force)
        )
    raise typer.Exit(code)


@app.command("profile")
def learn_profile(
    paths: Annotated[
        list[Path], typer.Argument(metavar="PATH", help="A video, logs or motion-capture files, or a folder of those.")
    ],
    key: Annotated[Path, typer.Option(metavar="FILE", help="The key file.")],
    out: Annotated[Path, typer.Option(metavar="FILE.profile", help="Where to write what was learnt.")],
    force: Force = False,
    onset: Annotated[
        str, typer.Option(metavar="SECONDS|auto", help="When the message begins, in the recording's own time.")
    ] = "auto",
    tracker: Annotated[str | None, typer.Option(metavar="NAME", help=_TRACKER_HELP)] = None,
    reference: Annotated[
        str,
        typer.Option(
            metavar="TRACK,...", help="Tracks that stand still, such as markers on the floor (default: found)."
        ),
    ] = "",
    camera: _Camera = None,
    assign: Annotated[
        list[str] | None, typer.Option(metavar="BODY=TRACK", help="Which track shows a body; may be repeated.")
    ] = None,
    topic: _Topics = None,
    body: _Bodies = None,
    unit: _Unit = None,
    time_unit: _TimeUnit = None,
    up: _Up = None,
    heading_axis: _HeadingAxis = None,
    arrival_times: _ArrivalTimes = False,
) -> None:
    """Learn how a type of robot follows commands from a recording that decodes, for shorter ones of it.

    Exit codes: 0 written, 1 error, 2 usage, 130 interrupted.
    """  # fmt: skip
    onset_s, pairs = _onset_s(onset), _pairs(assign or [])
    with reported("mtm-audit", "nothing was written"):
        from mtm_audit.commands.profile import ProfileOptions, run_profile
        from mtm_audit.decoding.settings import DecodeSettings

        settings = DecodeSettings(onset_s=onset_s, assignment=pairs)
        reading = _reading(topic, body, unit, time_unit, up, heading_axis, arrival_times=arrival_times)
        given = _given({
            "--tracker": tracker, "--reference": reference, "--camera": camera, "--topic": topic, "--body": body,
            "--unit": unit, "--time-unit": time_unit, "--up": up, "--heading-axis": heading_axis,
            "--arrival-times": arrival_times,
        })  # fmt: skip
        run_profile(
            ProfileOptions(
                tuple(paths),
                key,
                out,
                tracker or _TRACKER,
                _names(reference),
                settings,
                reading,
                force,
                given,
                _lens(camera),
            )
        )


@app.command("journal")
def show_journal(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="The journal that mtm-onboard run wrote.")],
    key: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The run's key, which makes the noise again that is left out.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Draw commands and lateness (.png, .pdf, .svg).")
    ] = None,
    force: Force = False,
) -> None:
    """Say what a robot's journal tells: message and start, ticks, lateness, limits, noise and events."""
    with reported("mtm-audit", "nothing was written"):
        from mtm_audit.commands.journal import run_journal

        run_journal(path, as_json=as_json, plot=plot, key=key, force=force)


@app.command()
def plan(
    table: Annotated[
        Path, typer.Argument(metavar="TABLE.csv", help="Measured accuracies: channel,M,t,successes,trials.")
    ],
    bits: Annotated[int, typer.Option(metavar="N", help="Bits that one message must carry.")],
    accuracy: Annotated[float, typer.Option(metavar="SHARE", help="Messages to be right, such as 0.9.")] = 0.9,
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", min=1e-3, help="Control rate, unless --like has it.")
    ] = None,
    like: Annotated[Path | None, typer.Option(metavar="KEY", help="A key of these robots: rate, band, noise.")] = None,
    alphabet: Annotated[
        list[int] | None, typer.Option(metavar="M", help="Alphabet size to consider; may be repeated (default: all).")
    ] = None,
    measured_only: Annotated[
        bool, typer.Option("--measured-only", help="Search measured points alone, as the paper does.")
    ] = False,
    sure: Annotated[
        bool, typer.Option("--sure", help="Plan so that the interval's lower end meets the target.")
    ] = False,
    check: Annotated[
        Path | None, typer.Option(metavar="TABLE.csv", help="Compare with accuracies of other recordings.")
    ] = None,
    strategy: Annotated[StrategyName | None, typer.Option(help="Which scheme to write (default: the fastest).")] = None,
    profile: Annotated[
        Path | None,
        typer.Option(metavar="FILE.toml", help="A profile of mtm-hil identify: shape the noise for such robots."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.toml", help="Scheme file for mtm-onboard keygen --scheme.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(metavar="FILE.png", help="Draw accuracy over T.")] = None,
    force: Force = False,
) -> None:
    """Find the fastest scheme for a payload and a target accuracy, from measured accuracies (docs/planning.md).

    Exit codes: 0 planned, 4 planned but --check disagrees, 1 error, 2 usage, 130 interrupted.
    """  # fmt: skip
    if rate is None and like is None:
        raise typer.BadParameter("give the control rate, or a key that has it with --like", param_hint="--rate")
    if rate is not None and like is not None:
        raise typer.BadParameter("--like has a rate already; leave out --rate", param_hint="--rate")
    if profile is not None and like is None:
        raise typer.BadParameter("the noise to shape is that of a key; give one with --like", param_hint="--profile")
    with reported("mtm-audit", "nothing was written"):
        from mtm_audit.commands.plan import PlanOptions, run_plan
        from mtm_audit.planning.plan import Problem

        problem = Problem(bits, accuracy, tuple(alphabet) if alphabet else None, measured_only, sure)
        chosen = None if strategy is None else strategy.value
        code = run_plan(PlanOptions(table, problem, rate, like, chosen, check, plot, out, force, profile))
    raise typer.Exit(code)


@app.command()
def duration(
    table: Annotated[Path, typer.Argument(metavar="TABLE.csv", help="Measured accuracies of the key's robots.")],
    key: Annotated[Path, typer.Option(metavar="FILE", help="The key file.")],
    accuracy: Annotated[float, typer.Option(metavar="SHARE", help="Messages to be right, such as 0.9.")] = 0.9,
    bits: Annotated[int | None, typer.Option(metavar="N", help="Bits to carry (default: all of a message).")] = None,
) -> None:
    """Say how long a recording must be for a key's message to be read with the wanted accuracy."""
    with reported("mtm-audit", "nothing was written"):
        from mtm_audit.commands.duration import run_duration

        run_duration(key, table, bits, accuracy)


@app.command()
def overhead() -> None:
    """Print what Reed-Solomon codes cost: factors on the time per goal, as in the paper."""
    with reported("mtm-audit", "nothing was written"):
        from mtm_audit.commands.overhead import run_overhead

        run_overhead()


def _onset_s(text: str) -> float | None:
    if text == "auto":
        return None
    try:
        onset_s = float(text)
    except ValueError:
        onset_s = math.nan
    if not math.isfinite(onset_s):
        raise typer.BadParameter(f"{text!r} is neither a number of seconds nor auto", param_hint="--onset")
    return onset_s


def _unix_s(text: str | None) -> float | None:
    if text is None:
        return None
    from datetime import UTC, datetime

    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        raise typer.BadParameter(
            f"{text!r} is no date and time; write it like 2026-01-31T12:00:00Z", param_hint="--at"
        ) from None
    return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()


def _given(options: Mapping[str, object]) -> frozenset[str]:
    """The names of those that were given, which are not None, empty or False."""
    return frozenset(name for name, value in options.items() if value)


def _lens(path: Path | None) -> "Lens | None":
    from mtm_audit.readers.lens_file import read_lens

    return None if path is None else read_lens(path)


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


def _pairs(texts: Sequence[str]) -> dict[str, str]:
    pairs: dict[str, str] = {}
    for text in texts:
        body, equals, track = text.partition("=")
        if not (body and equals and track):
            raise typer.BadParameter(f"{text!r} is not BODY=TRACK, such as robot0=marker3", param_hint="--assign")
        if body in pairs:
            raise typer.BadParameter(f"{body!r} is given two tracks; give it one", param_hint="--assign")
        pairs[body] = track
    return pairs


def _reading(
    topics: Sequence[str] | None,
    bodies: Sequence[str] | None,
    unit: str | None,
    time_unit: str | None,
    up: str | None,
    heading_axis: str | None,
    *,
    arrival_times: bool,
) -> "ReadOptions":
    from mtm_audit.readers.logs.options import ReadOptions, marker_groups
    from mtm_onboard.protocol.errors import command_line_values

    with command_line_values():
        return ReadOptions(
            unit=unit, time_unit=time_unit, up=up, heading_axis=heading_axis, topics=tuple(topics or ()),
            bodies=marker_groups(bodies or ()), arrival_times=arrival_times,
        )  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    """Run one command; leaves through SystemExit with the exit code."""
    # Many small products: threads cost twenty times what they save when the machine is busy. Must come before numpy.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    app(args=arguments, prog_name="mtm-audit", obj=arguments)
