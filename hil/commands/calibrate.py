"""`mtm-hil calibrate`: fit the simulated chassis to the paper's hardware."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from hil.experiments.detectors.calibrate import SLIPS_MPS, Candidate, best_candidate, scan, write_plant
from hil.experiments.detectors.paper_figures import MARGINS
from hil.experiments.runs.cells import CellStore
from hil.plants.mecanum import calibrated_parameters


def calibrate(rollouts: int, out: Path | None, cells: Path, console: Console) -> None:
    """Scan the slip, print what each gave and, where asked, write the plant's file."""
    plant = calibrated_parameters()
    with CellStore(cells) as store:
        candidates = scan(plant, SLIPS_MPS, rollouts, store, console)
    best = best_candidate(candidates)
    console.print(_table(candidates, best))
    print(f"slip_mps = {best.slip_mps:g} fits best")
    if out is not None:
        write_plant(out, plant, best, f"mtm-hil calibrate -n {rollouts}")
        print(f"wrote {out}")


def _table(candidates: list[Candidate], best: Candidate) -> Table:
    table = Table(
        title="margin over the paper's at each T (symbol accuracy in percent)", box=None, padding=(0, 1, 0, 0),
        pad_edge=False,
    )  # fmt: skip
    for name in ("slip", *map(str, MARGINS), "misfit"):
        table.add_column(name, justify="right", no_wrap=True)
    for candidate in candidates:
        ratios = [f"{ratio:.2f} ({100 * candidate.accuracies[ticks]:.0f})" for ticks, ratio in candidate.ratios.items()]
        style = "bold" if candidate is best else None
        table.add_row(f"{candidate.slip_mps:g}", *ratios, f"{candidate.misfit:.4f}", style=style)
    return table
