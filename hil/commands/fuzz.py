"""`mtm-hil fuzz`: damaged traffic into every end of every wire."""

from pathlib import Path

from rich.console import Console

from hil.experiments.hardening.fuzz import COUNTS, Summary, fuzz_cell, fuzz_cells, summarise
from hil.experiments.hardening.fuzz_targets import TARGETS
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep

_COLUMNS = ("target", *COUNTS, "most_altered_expected", "longest_ms")


def fuzz(inputs: int, seed: int, workers: int | None, out: Path | None, cells: Path, console: Console) -> bool:
    """Fuzz, print and, where asked, write the counts; False after a crash, no response or a made-up message."""
    asked = fuzz_cells(inputs, seed)
    with CellStore(cells) as store:
        results = run_sweep(fuzz_cell, asked, store, console, workers)
    summaries = [
        summarise(
            name, [result for cell, result in zip(asked, results, strict=True) if cell.parameters["target"] == name]
        )
        for name in TARGETS
    ]
    for one in summaries:
        print(_sentence(one))
        for failure in one.failures[:1]:
            print(failure)
    if out is not None:
        command = f"mtm-hil fuzz -n {inputs} --seed {seed} --out {out}"
        write_result_csv(out, command, _COLUMNS, map(_row, summaries))
        print(f"wrote {out}")
    return not any(one.counts[name] for one in summaries for name in ("unsent", "crashes", "unresponsive"))


def _sentence(one: Summary) -> str:
    expected = "text has no checksum" if one.most_altered is None else f"at most {one.most_altered:.2g} expected"
    counts = one.counts
    return (
        f"{one.target}: {counts['inputs']} inputs, {counts['crashes']} crashes, {counts['unresponsive']} times no "
        f"response, {counts['whole']} whole messages accepted, {counts['altered']} altered ({expected}), "
        f"{counts['unsent']} never sent; at most {one.longest_ms:.1f} ms an input"
    )


def _row(one: Summary) -> tuple[object, ...]:
    expected = "" if one.most_altered is None else f"{one.most_altered:.3g}"
    return (one.target, *(one.counts[name] for name in COUNTS), expected, one.longest_ms)
