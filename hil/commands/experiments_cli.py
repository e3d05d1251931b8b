"""The command lines of `mtm-hil`'s experiments; what each does is loaded when it is asked for."""

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from hil.commands.options import CELLS_FOLDER, Cells, CellSeed, FirstSeed, OutCsv, Workers, reported_console
from mtm_audit.commands.force import Force


class FrameName(StrEnum):
    """Where the noise of a message lives; in step with `hil.experiments.real.added.Frame`."""

    WORLD = "world"
    BODY = "body"


def calibrate(
    rollouts: Annotated[
        int, typer.Option("-n", metavar="N", min=1, help="Rollouts for each slip and window length.")
    ] = 20,
    out: Annotated[Path | None, typer.Option(metavar="FILE.toml", help="A plant's file to write as well.")] = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "calibrate.jsonl",
) -> None:
    """Fit the simulated chassis' wheel slip to the paper's margins."""
    with reported_console("mtm-hil calibrate", out, force=force) as console:
        from hil.commands.calibrate import calibrate as run

        run(rollouts, out, cells, console)


def bench(
    *,
    rollouts: Annotated[
        int, typer.Option(metavar="N", min=1, help="Rollouts of the main conditions; slow ones take fewer.")
    ] = 200,
    quick: Annotated[
        bool, typer.Option("--quick", help="A few rollouts of some conditions, for a first look.")
    ] = False,
    plants: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Other robots instead: all, or names and plant files parted by commas."),
    ] = None,
    ticks: Annotated[int, typer.Option(metavar="TICKS", min=10, help="With --plants: window of a symbol.")] = 100,
    spectra: Annotated[
        bool, typer.Option("--spectra", help="What the noise's spectrum is worth at 6 bits/s instead.")
    ] = False,
    rates: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="5 to 8 bits/s a robot instead: all, or names such as 4096x120."),
    ] = None,
    out: OutCsv = None,
    force: Force = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="A picture to draw: accuracy over the window length.")
    ] = None,
    cells: Cells = CELLS_FOLDER / "bench.jsonl",
) -> None:
    """Compare the paper's detector and ours with the genie, an oracle, on the same recordings."""
    if spectra and (quick or plot is not None or plants is not None):
        raise typer.BadParameter(
            "--spectra has one table of its own; leave out --quick, --plot and --plants", param_hint="--spectra"
        )
    if plants is not None and (quick or plot is not None):
        raise typer.BadParameter("--quick and --plot do not go with --plants; take fewer --rollouts for a first look")
    if rates is not None and (quick or plot is not None or plants is not None or spectra):
        raise typer.BadParameter(
            "--quick, --plot, --plants and --spectra do not go with --rates; take fewer --rollouts for a first look"
        )
    with reported_console("mtm-hil bench", out, plot, force=force) as console:
        if plants is not None:
            from hil.commands.bench_plants import PlantsOptions, bench_plants
            from hil.experiments.plants.rollout import PlantJob

            job = PlantJob(ticks=ticks)
            asked = PlantsOptions(plants=plants, job=job, rollouts=rollouts, out=out, cells=cells)
            bench_plants(asked, console)
            return
        if spectra:
            from hil.commands.bench_spectra import SpectraOptions, bench_spectra

            bench_spectra(SpectraOptions(rollouts, out, cells), console)
            return
        if rates is not None:
            from hil.commands.bench_rates import RatesOptions, bench_rates

            bench_rates(RatesOptions(rates, rollouts, out, cells), console)
            return
        from hil.commands.bench import BenchOptions
        from hil.commands.bench import bench as run

        run(BenchOptions(rollouts, quick, out, plot, cells), console)


def false_alarms(
    *,
    decodes: Annotated[
        int, typer.Option("-n", metavar="N", min=4, help="Decodes with a wrong key, and as many without.")
    ] = 3000,
    detector: Annotated[str, typer.Option(metavar="NAME", help="Which detector decodes.")] = "matched",
    seed: FirstSeed = 500_000,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "false-alarms.jsonl",
) -> None:
    """Decode recordings without a message under the given key, and compare the p-values with a uniform law."""
    with reported_console("mtm-hil false-alarms", out, force=force) as console:
        from hil.commands.false_alarms import false_alarms as run

        run(decodes, detector, seed, workers, out=out, cells=cells, console=console)


def messages(
    rollouts: Annotated[
        int, typer.Option("-n", metavar="N", min=1, help="Messages of the first kind; fewer of the others.")
    ] = 200,
    seed: FirstSeed = 700_000,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "messages.jsonl",
) -> None:
    """Count how many framed messages are received: whole, with a known time, and through occlusions."""
    with reported_console("mtm-hil messages", out, force=force) as console:
        from hil.commands.messages import messages as run

        run(rollouts, seed, workers, out, cells, console)


def disclosures(
    rollouts: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Films of each kind.")] = 10,
    seed: FirstSeed = 700_000,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "disclosures.jsonl",
) -> None:
    """Count how often a day's key is recovered from the motion of a later day's robots, by who has the anchor."""
    with reported_console("mtm-hil disclosures", out, force=force) as console:
        from hil.commands.disclosures import disclosures as run

        run(rollouts, seed, workers, out, cells, console)


def cameras(
    rollouts: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Runs that each camera films.")] = 2,
    seed: CellSeed = 900_000,
    *,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "cameras.jsonl",
    tilts: Annotated[bool, typer.Option("--tilts", help="Views from the side and a wide lens instead.")] = False,
) -> None:
    """Measure the evidence left by a camera that shakes, pans and rolls, and by markers at an angle."""
    with reported_console("mtm-hil cameras", out, force=force) as console:
        from hil.commands import cameras as measured

        run = measured.tilts if tilts else measured.cameras
        run(rollouts, seed, workers, out, cells, console)


def frames(
    count: Annotated[int, typer.Option("-n", metavar="N", min=200, help="Frames under noise for each check.")] = 10_000,
    seed: CellSeed = 0,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "frames.jsonl",
) -> None:
    """Decode noisy and attacked frames: how often a wrong payload passes the check, and which decoder reads most."""
    with reported_console("mtm-hil frames", out, force=force) as console:
        from hil.commands.frames import frames as run

        run(count, seed, workers, out, cells, console)


def shim(
    rollouts: Annotated[
        int, typer.Option("-n", metavar="N", min=1, help="Rollouts, each run with Python and with the shim.")
    ] = 100,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "shim.jsonl",
) -> None:
    """Play the message with the microcontroller's C code, in the loop, and compare with Python."""
    with reported_console("mtm-hil shim", out, force=force) as console:
        from hil.commands.shim import shim as run

        run(rollouts, out, cells, console)


def robustness(
    rollouts: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Rollouts under each condition.")] = 100,
    seed: FirstSeed = 600_000,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "robustness.jsonl",
) -> None:
    """Decode the same rollouts under uncalibrated cameras, frame times and clocks."""
    with reported_console("mtm-hil robustness", out, force=force) as console:
        from hil.commands.robustness import robustness as run

        run(rollouts, seed, workers, out, cells, console)


def sweep(
    world: Annotated[
        str,
        typer.Argument(metavar="WORLD", help="The world: robomaster, discovery, lunar-lander, reacher or football."),
    ],
    *,
    out: Annotated[Path, typer.Option(metavar="FILE.csv", help="The accuracy table to write, for mtm-audit plan.")],
    force: Force = False,
    rollouts: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Rollouts for each M and window.")] = 50,
    alphabet: Annotated[
        list[int] | None, typer.Option(metavar="M", help="Alphabet size; may be repeated (default: 4, 16, 64).")
    ] = None,
    window: Annotated[
        list[int] | None,
        typer.Option(metavar="TICKS", min=1, help="Window; may be repeated (default: 30, 45, 60, 80, 110, 150)."),
    ] = None,
    windows: Annotated[
        int, typer.Option(metavar="N", min=1, help="Windows in a row, about as many as a message will have.")
    ] = 2,
    scheme: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Measure this scheme's own windows, and whole messages.")
    ] = None,
    detector: Annotated[
        str, typer.Option(metavar="NAME", help="Which detector decodes: matched or coherency.")
    ] = "matched",
    seed: Annotated[
        int, typer.Option("--seed", "--first-seed", metavar="N", min=0, help="The first rollout's seed.")
    ] = 700_000,
    workers: Workers = None,
    cells: Cells = CELLS_FOLDER / "sweep.jsonl",
) -> None:
    """Measure how often a symbol is right, by channel, alphabet size and window length."""  # fmt: skip
    with reported_console("mtm-hil sweep", out, force=force) as console:
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
            first_seed=seed,
            workers=workers,
            out=out,
            cells=cells,
        )
        run(options, console)


def real(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Recorded trajectories without a message: TUM or CSV files.")
    ],
    *,
    messages: Annotated[
        int, typer.Option("-n", metavar="N", min=1, help="Messages on each recording, frame and sigma.")
    ] = 2,
    frame: Annotated[
        list[FrameName] | None, typer.Option(help="Where the noise lives; may be repeated (default: both).")
    ] = None,
    sigma: Annotated[
        list[float] | None,
        typer.Option(metavar="MPS", min=1e-4, max=10.0, help="Noise in m/s; may be repeated (default: 0.1)."),
    ] = None,
    alphabet: Annotated[int, typer.Option(metavar="M", min=2, help="Alphabet size.")] = 8,
    window: Annotated[float, typer.Option(metavar="SECONDS", min=0.1, help="Length of a symbol.")] = 4.0,
    seconds: Annotated[
        float, typer.Option(metavar="SECONDS", min=1.0, help="Length of the piece of each recording.")
    ] = 48.0,
    band: Annotated[str, typer.Option(metavar="LOW:HIGH", help="Band of the noise in Hz.")] = "0.5:4",
    threshold: Annotated[
        float, typer.Option(metavar="P", min=1e-12, max=1.0, help="How often a verdict may be wrong.")
    ] = 1e-4,
    onset_known: Annotated[bool, typer.Option("--onset-known", help="Tell the decode when the message began.")] = False,
    seed: FirstSeed = 800_000,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "real.jsonl",
) -> None:
    """Add messages to recorded motion, through plants drawn at random, and decode it."""
    with reported_console("mtm-hil real", out, force=force) as console:
        from hil.commands.real import RealOptions, band_of
        from hil.commands.real import real as run

        options = RealOptions(
            folder=folder,
            messages=messages,
            frames=tuple(name.value for name in frame or FrameName),
            sigmas=tuple(sigma or (0.1,)),
            alphabet_size=alphabet,
            window_s=window,
            seconds=seconds,
            band_hz=band_of(band),
            threshold=threshold,
            onset_known=onset_known,
            seed=seed,
            workers=workers,
            out=out,
            cells=cells,
        )
        run(options, console)


def identify(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="COMMANDS TRUTH", help="What was commanded and how the robot moved, for each robot."),
    ],
    *,
    offset: Annotated[
        float, typer.Option(metavar="SECONDS", help="Added to the commands' times, such as when a journal begins.")
    ] = 0.0,
    heading_axis: Annotated[
        str | None,
        typer.Option(
            metavar="AXIS",
            help="Axis of the tracked robot that points ahead: x, z, -y and so on (default: one that is level).",
        ),
    ] = None,
    plant: Annotated[
        Path | None, typer.Option(metavar="FILE.toml", help="A plant file to write, for bench --plants and record.")
    ] = None,
    profile: Annotated[
        Path | None, typer.Option(metavar="FILE.profile", help="A profile to write, for mtm-audit decode.")
    ] = None,
    summary: Annotated[
        str, typer.Option(metavar="TEXT", help="What kind of robot it is, for the plant file.")
    ] = "identified",
    source: Annotated[str, typer.Option(metavar="TEXT", help="Where the logs come from, for the plant file.")] = "",
    out: OutCsv = None,
    force: Force = False,
) -> None:
    """Measure how a robot follows its commands, from what was commanded and how it moved."""
    with reported_console("mtm-hil identify", out, plant, profile, force=force) as console:
        from hil.commands.identify import IdentifyOptions
        from hil.commands.identify import identify as run
        from mtm_audit.readers.logs.options import ReadOptions
        from mtm_onboard.protocol.errors import command_line_values

        with command_line_values():
            ReadOptions(heading_axis=heading_axis)
        options = IdentifyOptions(
            files=tuple(files),
            offset_s=offset,
            heading_axis=heading_axis,
            summary=summary,
            source=source,
            plant=plant,
            profile=profile,
            out=out,
        )
        run(options, console)


def faults(
    seeds: Annotated[
        int, typer.Option("-n", metavar="N", min=1, help="Runs of each combination of wire, fault and loss.")
    ] = 3,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="The first run's seed.")] = 0,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "faults.jsonl",
) -> None:
    """Run a robot under every fault of its wire, alone and with a lost link: stops, stale commands, the message."""
    with reported_console("mtm-hil faults", out, force=force) as console:
        from hil.commands.faults import faults as run

        if not run(seeds, seed, workers, out, cells, console):
            raise typer.Exit(1)


def fuzz(
    inputs: Annotated[
        int, typer.Option("-n", metavar="N", min=1, help="Inputs, over all ends of all wires.")
    ] = 1_000_000,
    seed: CellSeed = 0,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "fuzz.jsonl",
) -> None:
    """Feed damaged traffic to both ends of every wire, and count the messages that they accept."""
    with reported_console("mtm-hil fuzz", out, force=force) as console:
        from hil.commands.fuzz import fuzz as run

        if not run(inputs, seed, workers, out, cells, console):
            raise typer.Exit(1)


def forgeries(
    tries: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Tries, over all attacks.")] = 10_000,
    seed: CellSeed = 0,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "forgeries.jsonl",
) -> None:
    """Forge messages of keys as they are made by default: splices, journals, learnt codebooks, replays, relays.

    Stop it at any time: what is finished is kept, and the next run goes on. 10,000 take about an hour of a core.
    """
    with reported_console("mtm-hil forgeries", out, force=force) as console:
        from hil.commands.forgeries import forgeries as run

        if not run(tries, seed, workers, out, cells, console):
            raise typer.Exit(1)


def attacks(
    *,
    rollouts: Annotated[
        int,
        typer.Option(
            "-n", metavar="N", min=1, help="Rollouts at each level of the paper's tables; others take a part."
        ),
    ] = 50,
    only: Annotated[list[str] | None, typer.Option(metavar="NAME", help="This attack; may be repeated.")] = None,
    seed: FirstSeed = 40_000,
    workers: Workers = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="A folder to write attacks_NAME.csv in as well.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="A picture to draw: a panel for each attack.")
    ] = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "attacks.jsonl",
) -> None:
    """Suppress, forge and spy on messages: the paper's two tables of attacks, and a curve for each that it leaves open.

    Stop it at any time: what is finished is kept, and the next run goes on.
    """
    with reported_console("mtm-hil attacks", plot, force=force) as console:
        from hil.commands.attacks import AttackOptions
        from hil.commands.attacks import attacks as run

        options = AttackOptions(
            names=tuple(only or ()),
            rollouts=rollouts,
            first_seed=seed,
            workers=workers,
            out=out,
            plot=plot,
            force=force,
            cells=cells,
        )
        run(options, console)


def endurance(
    hours: Annotated[float, typer.Option(metavar="HOURS", min=0.0, help="Simulated hours.")] = 24.0,
    checkpoints: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of checkpoints, evenly spaced up to the end.")
    ] = 24,
    seed: Annotated[
        int, typer.Option(metavar="N", min=0, help="Decides where the robot goes and how its wheels slip.")
    ] = 0,
    out: OutCsv = None,
    force: Force = False,
) -> None:
    """Run one robot for a day in simulated time: memory, journal, ticks, and the message in each last minute."""
    with reported_console("mtm-hil endurance", out, force=force) as console:
        from hil.commands.endurance import endurance as run

        run(hours, checkpoints, seed, out, console)


def cost(
    *,
    keys: Annotated[list[Path], typer.Argument(metavar="KEY...", help="Keys whose noise is driven with.")],
    drives: Annotated[int, typer.Option("-n", metavar="N", min=2, help="Drives under each noise.")] = 200,
    seed: FirstSeed = 60_000,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "cost.jsonl",
) -> None:
    """Measure what noise costs the RoboMaster's task: time, path, heading, energy and jerk, beside white noise.

    Stop it at any time: what is finished is kept, and the next run goes on.
    """
    with reported_console("mtm-hil cost", out, force=force) as console:
        from hil.commands.cost import cost as run

        run(keys, drives, seed, console, workers=workers, out=out, cells=cells)


def presence(
    *,
    keys: Annotated[list[Path], typer.Argument(metavar="KEY...", help="Keys whose noise is driven with.")],
    plant: Annotated[str, typer.Option(metavar="NAME", help="The kind of robot, as for record.")] = "robomaster",
    drives: Annotated[int, typer.Option("-n", metavar="N", min=4, help="Drives under each kind of noise.")] = 600,
    seed: FirstSeed = 400_000,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "presence.jsonl",
) -> None:
    """Tell motion with a message from motion without and from unkeyed noise of the same band, without the key."""
    with reported_console("mtm-hil presence", out, force=force) as console:
        from hil.commands.presence import presence as run

        run(keys, plant, drives, seed, console, workers=workers, out=out, cells=cells)


def capacity(out: OutCsv = None, force: Force = False) -> None:
    """Compute what one robot could send by Shannon's bound: identified robots and the RoboMaster, by axis and noise."""
    with reported_console("mtm-hil capacity", out, force=force) as console:
        from hil.commands.capacity import capacity as run

        run(out, console)


def quiet(
    messages: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Messages at each amplitude.")] = 10,
    seed: FirstSeed = 970_000,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "quiet.jsonl",
) -> None:
    """Count plain messages received of an identified two-wheeled robot, by the amplitude of its noise."""
    with reported_console("mtm-hil quiet", out, force=force) as console:
        from hil.commands.quiet import quiet as run

        run(messages, seed, console, workers=workers, out=out, cells=cells)


# In the order in which --help lists them.
EXPERIMENTS: tuple[Callable[..., None], ...] = (
    calibrate, bench, capacity, cameras, false_alarms, messages, disclosures, frames, shim, robustness, sweep, real,
    identify, faults, fuzz, forgeries, attacks, cost, presence, quiet, endurance,
)  # fmt: skip
