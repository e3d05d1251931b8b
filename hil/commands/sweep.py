"""`mtm-hil sweep WORLD`: an accuracy table for `mtm-audit plan`."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import provenance
from hil.experiments.worlds.accuracy_table import Sweep, grid, measure, world_of
from mtm_audit.planning.table import write_table
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.schemefile import load_scheme

_ALPHABET_SIZES = (4, 16, 64)
_WINDOW_TICKS = (30, 45, 60, 80, 110, 150)


@dataclass(frozen=True, kw_only=True)
class SweepOptions:
    """What the command line asked for: `scheme`, or a grid of alphabets and windows (the usual ones where empty).

    `windows` of the grid are sent in a row, which a scheme decides itself.
    """

    world: str
    rollouts: int
    alphabet_sizes: tuple[int, ...]
    window_ticks: tuple[int, ...]
    windows: int
    scheme: Path | None
    detector: str
    first_seed: int
    workers: int | None
    out: Path
    cells: Path


def sweep(options: SweepOptions, console: Console) -> None:
    """Measure and write the table; with a scheme file say how many whole messages were right as well."""
    world_of(options.world)
    if options.scheme is None:
        schemes = grid(
            options.world,
            options.alphabet_sizes or _ALPHABET_SIZES,
            options.window_ticks or _WINDOW_TICKS,
            options.windows,
        )
    elif options.alphabet_sizes or options.window_ticks:
        raise MtmError("a scheme has its own alphabet and windows; leave out --alphabet and --window")
    else:
        schemes = (load_scheme(options.scheme),)
    asked = Sweep(options.world, schemes, options.detector, options.rollouts, options.first_seed)
    with CellStore(options.cells) as store:
        table, messages = measure(asked, store, console, options.workers)
    notes = []
    if options.scheme is not None:
        (whole,) = messages
        low, high = whole.interval_percent
        notes.append(
            f"whole messages right: {whole.successes} of {whole.trials}, {whole.percent:.1f} % "
            f"[{low:.1f}-{high:.1f}]"
        )  # fmt: skip
        print(notes[-1])
    write_table(options.out, table, provenance(_command(options), notes))
    print(f"wrote {options.out}: {len(table.points)} points of {len(table.channels)} channels, alone and pooled")


def _command(options: SweepOptions) -> str:
    what = [f"--alphabet {size}" for size in options.alphabet_sizes]
    what += [f"--window {ticks}" for ticks in options.window_ticks]
    what += [f"--windows {options.windows}"] if options.scheme is None else [f"--scheme {options.scheme}"]
    return " ".join(
        [f"mtm-hil sweep {options.world} -n {options.rollouts}", *what, f"--detector {options.detector}",
         f"--seed {options.first_seed} --out {options.out}"]
    )  # fmt: skip
