"""The command lines of `mtm-hil verdicts`; what each does is loaded when it is asked for."""

from typing import Annotated

import typer

from hil.commands.options import CELLS_FOLDER, Cells, FirstSeed, OutCsv, Workers, reported_console
from mtm_audit.commands.force import Force

verdicts = typer.Typer(help="Measure what a verdict is worth.", no_args_is_help=True, rich_markup_mode=None)

_FIRST_SEED = 700_000


@verdicts.command("validity")
def _validity(
    *,
    keys: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Keys on each recording.")] = 2000,
    recordings: Annotated[int, typer.Option(metavar="N", min=1, help="Recordings of every kind.")] = 2,
    only: Annotated[list[str] | None, typer.Option(metavar="KIND", help="This kind alone; may be repeated.")] = None,
    seed: FirstSeed = _FIRST_SEED,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "verdicts_validity.jsonl",
) -> None:
    """Decode hostile and dull recordings under keys that had no part in them."""
    with reported_console("mtm-hil verdicts validity", out, force=force) as console:
        from hil.commands.verdicts import VerdictOptions, known_names, validity
        from hil.experiments.verdicts.hostile import KINDS

        options = VerdictOptions(keys, known_names(only or (), KINDS), seed, workers, out, cells)
        validity(options, recordings, console)


@verdicts.command("sure")
def _sure(
    *,
    messages: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Messages on each vehicle.")] = 500,
    only: Annotated[list[str] | None, typer.Option(metavar="PLANT", help="This one alone; may be repeated.")] = None,
    seed: FirstSeed = _FIRST_SEED,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "verdicts_sure.jsonl",
) -> None:
    """Send messages on vehicles that no detector was tuned on, and count those decoded wrong."""
    with reported_console("mtm-hil verdicts sure", out, force=force) as console:
        from hil.commands.verdicts import VerdictOptions, known_names, sure
        from hil.experiments.verdicts.sure import PLANTS

        sure(VerdictOptions(messages, known_names(only or (), PLANTS), seed, workers, out, cells), console)


@verdicts.command("power")
def _power(
    rollouts: Annotated[
        int, typer.Option("-n", metavar="N", min=1, help="Rollouts of each condition and message length.")
    ] = 60,
    seed: FirstSeed = _FIRST_SEED,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "verdicts_power.jsonl",
) -> None:
    """Run the paper's job over message lengths, and see how often it is decoded."""
    with reported_console("mtm-hil verdicts power", out, force=force) as console:
        from hil.commands.verdicts import VerdictOptions, power

        power(VerdictOptions(rollouts, (), seed, workers, out, cells), console)


@verdicts.command("watched")
def _watched(
    streams: Annotated[
        int, typer.Option("-n", metavar="N", min=1, help="Streams of one silent robot each, watched for 60 s.")
    ] = 1000,
    seed: FirstSeed = _FIRST_SEED,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "verdicts_watched.jsonl",
) -> None:
    """Watch robots that send nothing, and count the verdicts."""
    with reported_console("mtm-hil verdicts watched", out, force=force) as console:
        from hil.commands.verdicts import VerdictOptions, watched

        watched(VerdictOptions(streams, (), seed, workers, out, cells), console)
