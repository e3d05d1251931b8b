"""The command line: `mtm-hil <command>`. Exit codes: 0 done, 1 error, 2 usage, 130 interrupted."""

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from hil.commands.options import CELLS_HELP, Renderer, reported_console
from hil.commands.paper_cli import paper

app = typer.Typer(
    help="Robots that send messages through motion, simulated with the real onboard software in the loop.",
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False,
)  # fmt: skip


class WireName(StrEnum):
    """What lies between the onboard software and a simulated robot."""

    CAN = "can"
    PLAINTEXT = "plaintext"
    MAVLINK = "mavlink"
    DIRECT = "direct"


class CameraName(StrEnum):
    """Keys of `hil.sensors.cameras.CAMERAS`, repeated so that --help need not load OpenCV."""

    OVERHEAD = "overhead"
    TILTED = "tilted"
    PHONE = "phone"


app.add_typer(paper, name="paper")


@app.callback()
def _every_command() -> None:
    pass


@app.command()
def record(
    out: Annotated[Path, typer.Option(help="The folder to make; it must not exist.")],
    *,
    message: Annotated[int | None, typer.Option(metavar="N", help="The message as a number.")] = None,
    no_message: Annotated[bool, typer.Option("--no-message", help="Move without a message.")] = False,
    seconds: Annotated[float, typer.Option(help="Length of the recording.")] = 26.0,
    key: Annotated[Path | None, typer.Option(help="The key file; one is made in the folder without it.")] = None,
    wire: Annotated[WireName, typer.Option(help="CAN, plaintext or MAVLink protocol, or no wire.")] = WireName.CAN,
    seed: Annotated[int, typer.Option(min=0, help="Decides everything random but the message's waveforms.")] = 0,
    camera: Annotated[CameraName, typer.Option(help="Which camera films.")] = CameraName.OVERHEAD,
    no_video: Annotated[bool, typer.Option("--no-video", help="Motion capture alone.")] = False,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Run the onboard programs in processes of their own, on real ports.")
    ] = False,
) -> None:
    """Record four simulated robots: motion capture, video, and what was sent."""
    if (message is None) != no_message:
        raise typer.BadParameter("give either --message N or --no-message")
    with reported_console() as console:
        from hil.commands.record import RecordOptions
        from hil.commands.record import record as run

        film = None if no_video else camera.value
        run(
            RecordOptions(
                out=out,
                seconds=seconds,
                message=message,
                key=key,
                wire=wire.value,
                seed=seed,
                camera=film,
                realtime=realtime,
            ),
            console,
        )


@app.command()
def film(
    world: Annotated[str, typer.Argument(metavar="WORLD", help="discovery, lunar-lander, reacher or football.")],
    *,
    out: Annotated[Path, typer.Option(help="The folder to make; it must not exist.")],
    message: Annotated[int | None, typer.Option(metavar="N", help="The message as a number.")] = None,
    no_message: Annotated[bool, typer.Option("--no-message", help="Move without a message.")] = False,
    seconds: Annotated[float, typer.Option(min=1.0, max=3600.0, help="Length of the film.")] = 30.0,
    key: Annotated[Path | None, typer.Option(help="The key file; one is made in the folder without it.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Decides everything random but the message's waveforms.")] = 0,
    renderer: Annotated[Renderer, typer.Option(help="Who draws: the software camera or the simulator.")] = (
        Renderer.SOFTWARE
    ),
) -> None:
    """Film one of the paper's simulated worlds while it sends a message on all its channels."""
    if (message is None) != no_message:
        raise typer.BadParameter("give either --message N or --no-message")
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
def demo(out: Annotated[Path, typer.Option(help="The folder to make; it must not exist.")]) -> None:
    """Send a message, film it, and decode it: the whole way in under a minute."""
    with reported_console() as console:
        from hil.commands.demo import demo as run

        if not run(out, console):
            raise typer.Exit(1)


@app.command()
def calibrate(
    rollouts: Annotated[int, typer.Option("-n", min=1, help="Rollouts for each slip and window length.")] = 20,
    out: Annotated[Path | None, typer.Option(help="The plant's file; that of the package by default.")] = None,
    cells: Annotated[Path, typer.Option(help=CELLS_HELP)] = Path("out/cells/calibrate.jsonl"),
) -> None:
    """Fit the simulated chassis' wheel slip to the paper's margins."""
    with reported_console() as console:
        from hil.commands.calibrate import calibrate as run

        run(rollouts, out, cells, console)


@app.command()
def bench(
    rollouts: Annotated[int, typer.Option(min=1, help="Rollouts of the main lines; the slow ones take a part.")] = 200,
    quick: Annotated[bool, typer.Option("--quick", help="A few rollouts of a few lines, for a first look.")] = False,
    out: Annotated[Path | None, typer.Option(help="A CSV file to write as well.")] = None,
    plot: Annotated[Path | None, typer.Option(help="A picture to draw: accuracy over the window length.")] = None,
    cells: Annotated[Path, typer.Option(help=CELLS_HELP)] = Path("out/cells/bench.jsonl"),
) -> None:
    """Compare the detectors, the paper's and ours, with the limit, on the same recordings."""
    with reported_console() as console:
        from hil.commands.bench import BenchOptions
        from hil.commands.bench import bench as run

        run(BenchOptions(rollouts, quick, out, plot, cells), console)


@app.command("false-alarms")
def false_alarms(
    decodes: Annotated[int, typer.Option("-n", min=4, help="Decodes with a wrong key, and as many without.")] = 3000,
    detector: Annotated[str, typer.Option(help="Which detector decodes.")] = "matched",
    seed: Annotated[int, typer.Option(min=0, help="The first rollout's seed.")] = 500_000,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores by default.")] = None,
    out: Annotated[Path | None, typer.Option(help="A CSV file to write as well.")] = None,
    cells: Annotated[Path, typer.Option(help=CELLS_HELP)] = Path("out/cells/false-alarms.jsonl"),
) -> None:
    """Decode recordings that hold nothing under the key asked, and see how the p-values are spread."""
    with reported_console() as console:
        from hil.commands.false_alarms import false_alarms as run

        run(decodes, detector, seed, workers, out=out, cells=cells, console=console)


@app.command()
def messages(
    rollouts: Annotated[int, typer.Option("-n", min=1, help="Messages of the first kind; fewer of the others.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="The first rollout's seed.")] = 700_000,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores by default.")] = None,
    out: Annotated[Path | None, typer.Option(help="A CSV file to write as well.")] = None,
    cells: Annotated[Path, typer.Option(help=CELLS_HELP)] = Path("out/cells/messages.jsonl"),
) -> None:
    """Send framed messages and see how many are received, whole, by the clock, and through occlusions."""
    with reported_console() as console:
        from hil.commands.messages import messages as run

        run(rollouts, seed, workers, out, cells, console)


@app.command()
def frames(
    count: Annotated[int, typer.Option("-n", min=200, help="Frames under noise for each check.")] = 10_000,
    seed: Annotated[int, typer.Option(min=0, help="The first cell's seed.")] = 0,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores by default.")] = None,
    out: Annotated[Path | None, typer.Option(help="A CSV file to write as well.")] = None,
    cells: Annotated[Path, typer.Option(help=CELLS_HELP)] = Path("out/cells/frames.jsonl"),
) -> None:
    """Decode noisy and attacked frames: how often a wrong payload passes the check, and which decoder reads most."""
    with reported_console() as console:
        from hil.commands.frames import frames as run

        run(count, seed, workers, out, cells, console)


@app.command()
def shim(
    rollouts: Annotated[int, typer.Option("-n", min=1, help="Rollouts, each run with Python and with the shim.")] = 100,
    out: Annotated[Path | None, typer.Option(help="A CSV file to write as well.")] = None,
    cells: Annotated[Path, typer.Option(help=CELLS_HELP)] = Path("out/cells/shim.jsonl"),
) -> None:
    """Play the message with the microcontroller's C code, in the loop, and compare with Python."""
    with reported_console() as console:
        from hil.commands.shim import shim as run

        run(rollouts, out, cells, console)


@app.command()
def robustness(
    rollouts: Annotated[int, typer.Option("-n", min=1, help="Rollouts under each condition.")] = 100,
    seed: Annotated[int, typer.Option(min=0, help="The first rollout's seed.")] = 600_000,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores by default.")] = None,
    out: Annotated[Path | None, typer.Option(help="A CSV file to write as well.")] = None,
    cells: Annotated[Path, typer.Option(help=CELLS_HELP)] = Path("out/cells/robustness.jsonl"),
) -> None:
    """Read the same rollouts through cameras, frames and clocks that nobody calibrated."""
    with reported_console() as console:
        from hil.commands.robustness import robustness as run

        run(rollouts, seed, workers, out, cells, console)


@app.command()
def sweep(
    world: Annotated[
        str,
        typer.Argument(metavar="WORLD", help="The world: robomaster, discovery, lunar-lander, reacher or football."),
    ],
    *,
    out: Annotated[Path, typer.Option(help="The accuracy table to write, for mtm-audit plan.")],
    rollouts: Annotated[int, typer.Option("-n", min=1, help="Rollouts for each M and window.")] = 50,
    alphabet: Annotated[
        list[int] | None, typer.Option(metavar="M", help="Alphabet size; may be repeated (default: 4, 16, 64).")
    ] = None,
    window: Annotated[
        list[int] | None,
        typer.Option(metavar="TICKS", min=1, help="Window; may be repeated (default: 30, 45, 60, 80, 110, 150)."),
    ] = None,
    windows: Annotated[int, typer.Option(min=1, help="Windows in a row, about as many as a message will have.")] = 2,
    scheme: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Measure this scheme's own windows, and whole messages.")
    ] = None,
    detector: Annotated[str, typer.Option(help="Which detector decodes: matched or coherency.")] = "matched",
    first_seed: Annotated[int, typer.Option(min=0, help="The first rollout's seed.")] = 700_000,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores by default.")] = None,
    cells: Annotated[Path, typer.Option(help=CELLS_HELP)] = Path("out/cells/sweep.jsonl"),
) -> None:
    """Measure how often a symbol is right, by channel, alphabet size and window length."""  # fmt: skip
    with reported_console() as console:
        from hil.commands.sweep import SweepOptions
        from hil.commands.sweep import sweep as run

        options = SweepOptions(
            world=world,
            rollouts=rollouts,
            alphabet_sizes=tuple(alphabet or ()),
            window_ticks=tuple(window or ()),
            windows=windows,
            scheme=scheme,
            detector=detector,
            first_seed=first_seed,
            workers=workers,
            out=out,
            cells=cells,
        )
        run(options, console)


@app.command()
def faults(
    seeds: Annotated[int, typer.Option("-n", min=1, help="Runs of each cell of the matrix.")] = 3,
    seed: Annotated[int, typer.Option(min=0, help="The first run's seed.")] = 0,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores by default.")] = None,
    out: Annotated[Path | None, typer.Option(help="A CSV file to write as well.")] = None,
    cells: Annotated[Path, typer.Option(help=CELLS_HELP)] = Path("out/cells/faults.jsonl"),
) -> None:
    """Run a robot under every fault of its wire, alone and with a lost link: stops, stale commands, the message."""
    with reported_console() as console:
        from hil.commands.faults import faults as run

        if not run(seeds, seed, workers, out, cells, console):
            raise typer.Exit(1)


@app.command()
def fuzz(
    inputs: Annotated[int, typer.Option("-n", min=1, help="Inputs, over all ends of all wires.")] = 1_000_000,
    seed: Annotated[int, typer.Option(min=0, help="The first cell's seed.")] = 0,
    workers: Annotated[int | None, typer.Option(min=1, help="Processes; as many as cores by default.")] = None,
    out: Annotated[Path | None, typer.Option(help="A CSV file to write as well.")] = None,
    cells: Annotated[Path, typer.Option(help=CELLS_HELP)] = Path("out/cells/fuzz.jsonl"),
) -> None:
    """Feed damaged traffic to the transports and the simulated robots, and see what they take for sound."""
    with reported_console() as console:
        from hil.commands.fuzz import fuzz as run

        if not run(inputs, seed, workers, out, cells, console):
            raise typer.Exit(1)


@app.command()
def endurance(
    hours: Annotated[float, typer.Option(min=0.0, help="Simulated hours.")] = 24.0,
    checkpoints: Annotated[int, typer.Option(min=1, help="How often to look, evenly spaced and at the end.")] = 24,
    seed: Annotated[int, typer.Option(min=0, help="Decides where the robot goes and how its wheels slip.")] = 0,
    out: Annotated[Path | None, typer.Option(help="A CSV file to write as well.")] = None,
) -> None:
    """Run one robot for a day in simulated time: memory, journal, ticks, and the message in each last minute."""
    with reported_console() as console:
        from hil.commands.endurance import endurance as run

        run(hours, checkpoints, seed, out, console)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run one command; leaves through SystemExit with the exit code."""
    app(args=arguments, prog_name="mtm-hil")
