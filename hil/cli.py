"""The command line: `mtm-hil <command>`. Exit codes: docs/command-line.md."""

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from hil.commands.clusters import takes_scheduler
from hil.commands.codecs_cli import codecs
from hil.commands.experiments_cli import EXPERIMENTS
from hil.commands.options import (
    KeyFile,
    MessageBytes,
    MessageNumber,
    MessageText,
    NewFolder,
    NoMessage,
    Renderer,
    RendererName,
    WorldSeed,
    content_of,
    reported_console,
    require_message_or_none,
)
from hil.commands.paper_cli import paper
from hil.commands.verdicts_cli import verdicts
from mtm_audit.commands.manner import HELP_OPTIONS, version_option

app = typer.Typer(
    help="Robots that send messages through motion, simulated with the real onboard software in the loop.",
    no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None, context_settings=HELP_OPTIONS,
)  # fmt: skip


class WireName(StrEnum):
    """What lies between the onboard software and a simulated robot."""

    CAN = "can"
    PLAINTEXT = "plaintext"
    MAVLINK = "mavlink"
    DIRECT = "direct"


class FloorName(StrEnum):
    """Keys of `hil.sensors.cameras.FLOORS`."""

    MAT = "mat"
    CARPET = "carpet"
    MARKERS = "markers"


class CameraName(StrEnum):
    """Keys of `hil.sensors.cameras.CAMERAS`, repeated so that --help need not load OpenCV."""

    OVERHEAD = "overhead"
    TILTED = "tilted"
    PHONE = "phone"


class QualityName(StrEnum):
    """Keys of `hil.sensors.film_qualities.FILM_QUALITIES`, repeated so that --help need not load OpenCV."""

    PHONE = "phone"
    ACTION_CAMERA = "action-camera"
    SURVEILLANCE = "surveillance"
    MESSENGER = "messenger"


@app.callback()
def _every_command(
    version: Annotated[bool, version_option("mtm-hil")] = False,
) -> None:
    pass


@app.command()
def record(
    *,
    out: NewFolder,
    message: MessageNumber = None,
    text: MessageText = None,
    hexadecimal: MessageBytes = None,
    no_message: NoMessage = False,
    seconds: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", min=0.1, max=86_400.0, help="Length of the recording (default: 26, or one message)."
        ),
    ] = None,
    robots: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            help="How many robots; those beyond the key's bodies send nothing (default: these, or 4).",
        ),
    ] = None,
    key: KeyFile = None,
    anchor: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A fleet's anchor, on whose public channel --disclosed is played."),
    ] = None,
    disclosed: Annotated[
        Path | None, typer.Option(metavar="FILE", help="With --anchor: the disclosed key of a day that is over.")
    ] = None,
    wire: Annotated[WireName, typer.Option(help="CAN, plaintext or MAVLink protocol, or no wire.")] = WireName.CAN,
    seed: WorldSeed = 0,
    plant: Annotated[
        str, typer.Option(metavar="NAME", help="Kind of the robots, see mtm-hil bench --plants; or a plant file.")
    ] = "robomaster",
    camera: Annotated[CameraName, typer.Option(help="Which camera films.")] = CameraName.OVERHEAD,
    quality: Annotated[
        QualityName | None, typer.Option(help="Encode the film as these do; nearly lossless without.")
    ] = None,
    shake_px: Annotated[
        float,
        typer.Option(
            metavar="PIXELS", min=0.0, max=100.0, help="How far a hand shakes the camera, rms in pixels below 3 Hz."
        ),
    ] = 0.0,
    pan_deg: Annotated[
        float, typer.Option(metavar="DEGREES", min=-60.0, max=60.0, help="How far the camera pans while it films.")
    ] = 0.0,
    roll_deg: Annotated[
        float, typer.Option(metavar="DEGREES", min=0.0, max=45.0, help="How far the camera rolls to and fro.")
    ] = 0.0,
    floor: Annotated[
        FloorName, typer.Option(help="A faint mat, a carpet, or a mat with markers on it.")
    ] = FloorName.MAT,
    no_video: Annotated[bool, typer.Option("--no-video", help="Motion capture alone.")] = False,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Run the onboard programs in processes of their own, on real ports.")
    ] = False,
) -> None:
    """Record simulated robots that play any key: motion capture, video, and what was sent."""
    with reported_console() as console:
        if anchor is None and disclosed is None:
            content = content_of(message, text, hexadecimal, no_message)
        elif anchor is None or disclosed is None or key or realtime or no_message or message or text or hexadecimal:
            raise typer.BadParameter("give --anchor and --disclosed together, and no key, message or --realtime beside")
        else:
            content = None
        from math import radians

        from hil.commands.record import RecordOptions, carried
        from hil.commands.record import record as run
        from hil.sensors.camera_motion import CameraMotion

        moves = bool(shake_px or pan_deg or roll_deg)
        motion = CameraMotion(shake_px=shake_px, pan_rad=radians(pan_deg), roll_rad=radians(roll_deg))
        film = None if no_video else camera.value
        run(
            RecordOptions(
                out=out,
                seconds=seconds,
                content=content,
                key=key,
                wire=wire.value,
                seed=seed,
                camera=film,
                realtime=realtime,
                quality=None if quality is None else quality.value,
                motion=motion if moves else None,
                floor=floor.value,
                plant=plant,
                robots=robots,
                carried=None if anchor is None or disclosed is None else carried(anchor, disclosed),
            ),
            console,
        )


@app.command()
def film(
    world: Annotated[str, typer.Argument(metavar="WORLD", help="discovery, lunar-lander, reacher or football.")],
    *,
    out: NewFolder,
    message: MessageNumber = None,
    no_message: NoMessage = False,
    seconds: Annotated[float, typer.Option(metavar="SECONDS", min=1.0, max=3600.0, help="Length of the film.")] = 30.0,
    key: KeyFile = None,
    seed: WorldSeed = 0,
    renderer: RendererName = Renderer.SOFTWARE,
) -> None:
    """Film one of the paper's simulated worlds while it sends a message on all its channels."""
    require_message_or_none(message, no_message)
    with reported_console() as console:
        from hil.commands.film import FilmOptions
        from hil.commands.film import film as run

        run(
            FilmOptions(
                world=world, out=out, seconds=seconds, message=message, key=key, seed=seed, renderer=renderer.value
            ),
            console,
        )


@app.command()
def demo(out: NewFolder) -> None:
    """Send a message, film it, and decode it: the whole way in under a minute."""
    with reported_console() as console:
        from hil.commands.demo import demo as run

        if not run(out, console):
            raise typer.Exit(1)


for _experiment in EXPERIMENTS:
    app.command()(_experiment)
app.add_typer(paper, name="paper")
app.add_typer(verdicts, name="verdicts")
app.add_typer(codecs, name="codecs")
for _app in (app, paper, verdicts, codecs):
    for _command in _app.registered_commands:
        if _command.callback is not None:
            _command.callback = takes_scheduler(_command.callback)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run one command; leaves through SystemExit with the exit code."""
    app(args=arguments, prog_name="mtm-hil")
