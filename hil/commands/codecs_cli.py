"""The command lines of `mtm-hil codecs`; what each does is loaded when it is asked for."""

from typing import Annotated

import typer

from hil.commands.options import CELLS_FOLDER, Cells, FirstSeed, OutCsv, Workers, reported_console
from mtm_audit.commands.force import Force

codecs = typer.Typer(
    help="Measure what encoders leave of a message in a film.", no_args_is_help=True, rich_markup_mode=None
)

_FIRST_SEED = 900_000


@codecs.command("evidence")
def _evidence(
    rollouts: Annotated[
        int, typer.Option("-n", metavar="N", min=1, help="Rollouts of each loudness and size of picture.")
    ] = 1,
    seed: FirstSeed = _FIRST_SEED,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "codecs.jsonl",
) -> None:
    """Film four robots, encode the film as cameras and programs do, and decode each copy."""
    with reported_console("mtm-hil codecs evidence", out, force=force) as console:
        from hil.commands.codecs import CodecOptions, evidence

        evidence(CodecOptions(rollouts, seed, workers, out, cells), console)


@codecs.command("motion")
def _motion(
    films: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Films of each size of motion.")] = 3,
    seed: FirstSeed = _FIRST_SEED,
    workers: Workers = None,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "codecs_motion.jsonl",
) -> None:
    """Film a marker that moves by parts of a pixel, encode the film, and track each copy."""
    with reported_console("mtm-hil codecs motion", out, force=force) as console:
        from hil.commands.codecs import CodecOptions, motion

        motion(CodecOptions(films, seed, workers, out, cells), console)
