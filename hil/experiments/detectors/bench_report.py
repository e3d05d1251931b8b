"""The benchmark's rows as a table, a file and a picture."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.table import Table

from hil.experiments.detectors.bench import DETECTORS, PAPER_SIGMA, Row
from hil.experiments.detectors.bench_rollout import COHERENCY, GENIE, MATCHED
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.result_file import write_result_csv
from mtm_audit.reporting.figure_file import save_figure

_COLUMNS = ("alphabet_size", "window_ticks", "windows", "sigma", "detector", "rollouts")
_COLOURS = {COHERENCY: "#b42318", MATCHED: "#3366cc", GENIE: "#475467"}
_MARKERS = {COHERENCY: "s", MATCHED: "o", GENIE: "^"}
_LABELS = {COHERENCY: "coherency (the paper's)", MATCHED: "matched (blind)", GENIE: "genie (told everything else)"}


def rich_table(rows: Sequence[Row]) -> Table:
    """One row for each job and detector; percent with exact 95 % intervals."""
    table = Table(
        title="RoboMaster, four robots; percent with exact 95 % intervals", box=None, padding=(0, 1, 0, 0),
        pad_edge=False,
    )  # fmt: skip
    for name in ("M", "T", "windows", "sigma", "bits/s", "detector", "n", "symbols", "messages"):
        table.add_column(name, justify="left" if name == "detector" else "right", no_wrap=True)
    for row in _ordered(rows):
        job = row.job
        bits = np.log2(job.alphabet_size) * job.scheme.rate_hz / job.window_ticks
        messages = _with_interval(row.messages) if job.windows == 1 else ""
        table.add_row(
            str(job.alphabet_size), str(job.window_ticks), str(job.windows), f"{job.sigma:g}", f"{bits:.2f}",
            row.detector, str(row.rollouts), _with_interval(row.symbols), messages,
        )  # fmt: skip
    return table


def write_csv(path: Path, rows: Sequence[Row], command: str, notes: Sequence[str]) -> None:
    """Write the rows under the command line and the notes."""
    shares = [f"{share}{end}" for share in ("symbol", "message") for end in ("s", "s_correct", *_ends("_percent"))]
    write_result_csv(path, command, (*_COLUMNS, *shares), (_csv_row(row) for row in _ordered(rows)), notes)


def draw_plot(path: Path, rows: Sequence[Row]) -> None:
    """Whole messages in the paper's job over the window length, one line a detector."""
    figure = Figure(figsize=(8.0, 5.0), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for place, name in enumerate(DETECTORS):
        mine = [row for row in _ordered(rows) if row.detector == name and row.job.windows == 1]
        mine = [row for row in mine if row.job.sigma == PAPER_SIGMA]
        # Set apart a little, so that bars do not hide each other.
        ticks = np.array([row.job.window_ticks for row in mine]) * (0.985 + 0.015 * place)
        percents = np.array([row.messages.percent for row in mine])
        ends = np.array([row.messages.interval_percent for row in mine]).reshape(-1, 2).T
        axes.errorbar(
            ticks, percents, yerr=np.maximum(0.0, [percents - ends[0], ends[1] - percents]), label=_LABELS[name],
            color=_COLOURS[name], marker=_MARKERS[name], markersize=5, capsize=3, linewidth=1.5,
        )  # fmt: skip
    axes.axhline(99.0, color="#a9b4c2", linewidth=0.8, linestyle=":")
    axes.set_xscale("log")
    shown = sorted({row.job.window_ticks for row in rows if row.job.windows == 1})
    axes.set_xticks(shown, [str(ticks) for ticks in shown])
    axes.minorticks_off()
    axes.set_xlabel("T, ticks of 20 ms")
    axes.set_ylabel("messages with all four symbols right (%)")
    axes.set_ylim(-3.0, 103.0)
    axes.set_title("One 2-bit symbol from each of four robots, onset known, sigma 0.1 m/s", fontsize=11)
    axes.legend(loc="lower right", frameon=False)
    axes.grid(axis="y", color="#e4e7ec", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    save_figure(figure, path, "mtm-hil bench")


def _ordered(rows: Sequence[Row]) -> list[Row]:
    def place(row: Row) -> tuple[float, ...]:
        job = row.job
        swept = job.sigma != PAPER_SIGMA
        return job.windows, swept, job.alphabet_size, job.window_ticks, job.sigma, DETECTORS.index(row.detector)

    return sorted(rows, key=place)


def _ends(name: str) -> tuple[str, str, str]:
    return name, f"{name}_low", f"{name}_high"


def _csv_row(row: Row) -> tuple[object, ...]:
    job = row.job
    given = (job.alphabet_size, job.window_ticks, job.windows, job.sigma, row.detector, row.rollouts)
    return (*given, *_share_fields(row.symbols), *_share_fields(row.messages))


def _share_fields(share: Proportion) -> tuple[object, ...]:
    return share.trials, share.successes, *share.figures


def _with_interval(proportion: Proportion) -> str:
    low, high = proportion.interval_percent
    return f"{proportion.percent:.1f} [{low:.1f}-{high:.1f}]"
