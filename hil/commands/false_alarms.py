"""`mtm-hil false-alarms`: verdicts on recordings in which there is nothing to read."""

from pathlib import Path

import numpy as np
from rich.console import Console

from hil.experiments.detectors.false_alarms import NO_MESSAGE, WRONG_KEY, decode_nothing, false_alarm_cells, summarise
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.intervals import clopper_pearson
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep
from mtm_audit.detectors import make_detector

_COLUMNS = ("arm", "detector", "decodes", "decoded", "inconclusive", "ks_p", "level", "below", "low", "high")
_LEVELS = (0.5, 0.1, 0.05, 0.01, 0.001, 0.0001)


def false_alarms(
    decodes: int, detector: str, seed: int, workers: int | None, *, out: Path | None, cells: Path, console: Console
) -> None:
    """Measure, print and, where asked, write how often p-values fall below each level."""
    make_detector(detector)
    summaries = []
    with CellStore(cells) as store:
        for arm in (WRONG_KEY, NO_MESSAGE):
            asked = false_alarm_cells(arm, decodes, detector, seed)
            summaries.append(summarise(arm, run_sweep(decode_nothing, asked, store, console, workers)))
    rows: list[tuple[object, ...]] = []
    for summary in summaries:
        count = len(summary.p_values)
        print(
            f"{summary.arm}: {count} decodes, {summary.decoded} decoded, {summary.inconclusive} inconclusive, "
            f"p-values uniform with Kolmogorov-Smirnov p = {summary.uniformity:.3f}"
        )
        for level in _LEVELS:
            below = int(np.sum(summary.p_values <= level))
            low, high = clopper_pearson(below, count)
            print(f"  p <= {level:g}: {below} ({below / count:.5f}, 95 % interval {low:.5f} to {high:.5f})")
            rows.append(
                (summary.arm, detector, count, summary.decoded, summary.inconclusive, f"{summary.uniformity:.4f}",
                 level, below, f"{low:.6f}", f"{high:.6f}")
            )  # fmt: skip
    if out is not None:
        command = f"mtm-hil false-alarms -n {decodes} --detector {detector} --seed {seed} --out {out}"
        write_result_csv(out, command, _COLUMNS, rows)
        print(f"wrote {out}")
