"""`mtm-hil forgeries`: forgers against keys as they are made by default."""

from pathlib import Path

from rich.console import Console

from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.intervals import clopper_pearson
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep
from hil.experiments.verdicts.forgeries import CONTROL, COUNTS, FORGED, forgery_cells, try_forgeries
from hil.experiments.verdicts.forgers import ATTACKS

_COLUMNS = ("attack", "role", *(count.replace(" ", "_") for count in COUNTS), "authenticated_percent_high")


def forgeries(tries: int, seed: int, workers: int | None, out: Path | None, cells: Path, console: Console) -> bool:
    """Try, print and, where asked, write the counts; False when a forgery was authenticated, or a control not read."""
    asked = forgery_cells(tries, seed)
    with CellStore(cells) as store:
        results = run_sweep(try_forgeries, asked, store, console, workers)
    rows: list[tuple[str, str, dict[str, int]]] = []
    for name in ATTACKS:
        for role in (FORGED, CONTROL):
            wanted = {"attack": name, "role": role}
            own = [
                result
                for cell, result in zip(asked, results, strict=True)
                if wanted.items() <= dict(cell.parameters).items()
            ]
            rows.append((name, role, {count: sum(int(result[count]) for result in own) for count in COUNTS}))
    for name, role, counts in rows:
        print(f"{name}, {role}: {', '.join(f'{counts[count]} {count}' for count in COUNTS)}")
    forged = [counts for _, role, counts in rows if role == FORGED]
    total, passed = (sum(counts[what] for counts in forged) for what in ("tries", "authenticated"))
    high = clopper_pearson(passed, total)[1]
    summary = f"of {total} forgeries {passed} were authenticated: at most {100 * high:.3f} % with 95 % confidence"
    print(summary)
    if out is not None:
        command = f"mtm-hil forgeries -n {tries} --seed {seed} --out {out}"
        lines = [(*line[:2], *line[2].values(), _highest(line[2])) for line in rows]
        write_result_csv(out, command, _COLUMNS, lines, (summary,))
        print(f"wrote {out}")
    return passed == 0 and all(counts["decoded"] > 0 for _, role, counts in rows if role == CONTROL)


def _highest(counts: dict[str, int]) -> str:
    """The upper end of the exact 95 % interval of the share that was authenticated, percent."""
    return f"{100 * clopper_pearson(counts['authenticated'], counts['tries'])[1]:.3f}"
