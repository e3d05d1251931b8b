"""`mtm-hil paper <table>`: the paper's tables."""

from pathlib import Path
from typing import Annotated

import typer

from hil.commands.options import (
    CELLS_FOLDER,
    Cells,
    FirstSeed,
    OutCsv,
    Renderer,
    RendererName,
    Workers,
    reported_console,
)
from mtm_audit.commands.force import Force

paper = typer.Typer(
    help="The paper's tables, measured on the simulated robots.", no_args_is_help=True, rich_markup_mode=None
)


@paper.command("robomaster")
def paper_robomaster(
    rollouts: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Rollouts for each row of the table.")] = 40,
    quick: Annotated[bool, typer.Option("--quick", help="Five rollouts, for a first look.")] = False,
    out: OutCsv = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "robomaster.jsonl",
) -> None:
    """Accuracy and margin over the window length, with a wrong key and without a message, beside the paper's."""
    with reported_console("mtm-hil paper robomaster", out, force=force) as console:
        from hil.commands.paper import paper_robomaster as run

        run(5 if quick else rollouts, out, cells, console)


_Rollouts = Annotated[
    int,
    typer.Option(
        "-n",
        metavar="N",
        min=1,
        help="Rollouts at the headline's scheme, Football 64 for each ten; others take a part.",
    ),
]
_Quick = Annotated[bool, typer.Option("--quick", help="One rollout of a few points, for a first look.")]


def _paper_worlds(
    context: typer.Context,
    *,
    rollouts: _Rollouts = 50,
    quick: _Quick = False,
    seed: FirstSeed = 10_000,
    renderer: RendererName = Renderer.SOFTWARE,
    workers: Workers = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.csv|FOLDER", help="A CSV file to write as well; a folder for all.")
    ] = None,
    force: Force = False,
    cells: Cells = CELLS_FOLDER / "worlds.jsonl",
) -> None:
    with reported_console() as console:
        from hil.commands.paper import WorldOptions, paper_table

        paper_table(
            str(context.info_name),
            WorldOptions(
                rollouts=rollouts,
                quick=quick,
                first_seed=seed,
                renderer=renderer.value,
                workers=workers,
                out=out,
                force=force,
                cells=cells,
            ),
            console,
        )


for _name, _help in {
    "discovery": "A navigating agent from video: both detectors beside the paper's figures.",
    "lunar-lander": "A lander over its pads from video: both detectors beside the paper's figures.",
    "reacher": "A two-link arm from video: both detectors beside the paper's figures.",
    "football": "A team of three from video: both detectors beside the paper's figures.",
    "null": "All simulated worlds with wrong keys and without a message.",
    "performance": "What the noise costs the tasks: the paper's measures, energy, jerk, commands at the limit.",
    "all": "All tables of the simulated worlds.",
}.items():
    paper.command(_name, help=_help)(_paper_worlds)
