"""`mtm-hil bench`: three detectors on the same recordings."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from hil.experiments.detectors.bench import PAPER_SIGMA, conditions, measure, quick_conditions
from hil.experiments.detectors.bench_report import draw_plot, rich_table, write_csv
from hil.experiments.detectors.bench_rollout import silent_motions
from hil.experiments.detectors.bench_summary import summary
from hil.experiments.detectors.capacity import capacity_bps
from hil.experiments.runs.cells import CellStore
from hil.plants.mecanum import MecanumParameters, calibrated_parameters
from hil.worlds.robomaster import fleet_scheme
from mtm_audit.reporting.plot import check_plot_path

_SILENT_S = 17.5
_SILENCES, _QUICK_SILENCES = 30, 3


@dataclass(frozen=True)
class BenchOptions:
    """What to measure and where to write it; `quick` overrides the number of rollouts."""

    rollouts: int
    quick: bool
    out: Path | None
    plot: Path | None
    cells: Path


def bench(options: BenchOptions, console: Console) -> None:
    """Measure, print and, where asked, write the table and the picture."""
    if options.plot is not None:
        check_plot_path(options.plot)
    plant = calibrated_parameters()
    asked = quick_conditions() if options.quick else conditions(options.rollouts)
    silences = _QUICK_SILENCES if options.quick else _SILENCES
    with CellStore(options.cells) as store:
        rows = measure(asked, plant, store, console, silences=silences)
    sentences = [*summary(rows), _capacity_sentence(plant, silences)]
    console.print(rich_table(rows))
    print("\n".join(sentences))
    if options.out is not None:
        write_csv(options.out, rows, _command(options), (f"{plant}", *sentences))
        print(f"wrote {options.out}")
    if options.plot is not None:
        draw_plot(options.plot, rows)
        print(f"wrote {options.plot}")


def _capacity_sentence(plant: MecanumParameters, silences: int) -> str:
    scheme = fleet_scheme()
    motions = silent_motions(_SILENT_S, plant, silences)
    bound = capacity_bps(plant, PAPER_SIGMA, scheme.rate_hz, scheme.band_hz, motions)
    return f"Shannon capacity at sigma {PAPER_SIGMA:g} m/s against Gaussian interference: {bound:.1f} bits/s a robot"


def _command(options: BenchOptions) -> str:
    amount = "--quick" if options.quick else f"--rollouts {options.rollouts}"
    files = [f"--{name} {path}" for name, path in (("out", options.out), ("plot", options.plot)) if path is not None]
    return " ".join(["mtm-hil bench", amount, *files])
