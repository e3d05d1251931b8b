"""`mtm-hil disclosures`: how often a day's key is recovered from the motion of a later day's robots."""

from pathlib import Path

from rich.console import Console

from hil.experiments.messages.disclosures import SIGHTS, key_bps, recover, seconds_of
from hil.experiments.runs.cells import Cell, CellStore
from hil.experiments.runs.intervals import clopper_pearson
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep

_COLUMNS = ("sight", "robots", "seconds", "key_bps", "rollouts", "recovered", "share", "low", "high", "wrong")


def disclosures(rollouts: int, seed: int, workers: int | None, out: Path | None, cells: Path, console: Console) -> None:
    """Measure, print and, where asked, write the share of films that show the key."""
    rows: list[tuple[object, ...]] = []
    with CellStore(cells) as store:
        for name, sight in SIGHTS.items():
            asked = [Cell("disclosures", {"sight": name}, seed + row) for row in range(rollouts)]
            results = run_sweep(recover, asked, store, console, workers)
            recovered, wrong = (sum(bool(result[field]) for result in results) for field in ("recovered", "wrong"))
            low, high = clopper_pearson(recovered, rollouts)
            print(
                f"{name:42s} {recovered} of {rollouts} recovered, {100 * recovered / rollouts:.1f} % "
                f"[{100 * low:.1f}-{100 * high:.1f}], {wrong} wrong, {seconds_of(sight):g} s, "
                f"{key_bps(sight):.2f} bits/s"
            )
            shares = [f"{value:.5f}" for value in (recovered / rollouts, low, high)]
            film = (sight.robots, f"{seconds_of(sight):g}", f"{key_bps(sight):.4f}")
            rows.append((name, *film, rollouts, recovered, *shares, wrong))
    if out is not None:
        write_result_csv(out, f"mtm-hil disclosures -n {rollouts} --seed {seed} --out {out}", _COLUMNS, rows)
        print(f"wrote {out}")
