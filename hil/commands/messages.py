"""`mtm-hil messages`: how often whole framed messages are received."""

from pathlib import Path

from rich.console import Console

from hil.experiments.messages.jobs import JOBS, payload_bps, receive
from hil.experiments.runs.cells import Cell, CellStore
from hil.experiments.runs.intervals import clopper_pearson
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep

_COLUMNS = ("job", "payload_bps", "rollouts", "received", "share", "low", "high", "wrong")
# The first job has all rollouts, the others a part of them; long recordings take long.
_OTHERS_PART, _REPEATED_PART = 4, 8


def messages(rollouts: int, seed: int, workers: int | None, out: Path | None, cells: Path, console: Console) -> None:
    """Measure, print and, where asked, write the share of messages that are received."""
    rows: list[tuple[object, ...]] = []
    with CellStore(cells) as store:
        for name, job in JOBS.items():
            part = _REPEATED_PART if job.repetitions > 1 else _OTHERS_PART if rows else 1
            count = -(-rollouts // part)
            asked = [Cell("messages", {"job": name}, seed + row) for row in range(count)]
            results = run_sweep(receive, asked, store, console, workers)
            received, wrong = (sum(bool(result[field]) for result in results) for field in ("received", "wrong"))
            low, high = clopper_pearson(received, count)
            print(
                f"{name:52s} {received} of {count} received, {100 * received / count:.1f} % "
                f"[{100 * low:.1f}-{100 * high:.1f}], {wrong} wrong, {payload_bps(job):.2f} bits/s of payload"
            )
            shares = [f"{value:.5f}" for value in (received / count, low, high)]
            rows.append((name, f"{payload_bps(job):.4f}", count, received, *shares, wrong))
    if out is not None:
        write_result_csv(out, f"mtm-hil messages -n {rollouts} --seed {seed} --out {out}", _COLUMNS, rows)
        print(f"wrote {out}")
