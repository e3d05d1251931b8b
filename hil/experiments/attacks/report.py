"""Attacks as tables in files and as a picture."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hil.experiments.attacks.attack import Attack
from hil.experiments.attacks.measured import Row
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.worlds.reading import COHERENCY, MATCHED
from mtm_audit.reporting.figure_file import save_figure

_COLUMNS = (
    "arm", "level", "reader", "trials", "right", "percent", "percent_low", "percent_high", "margin",
    "distortion_percent", "distance_percent", "foretold_r2", "paper_table", "paper_percent", "paper_margin",
    "paper_distortion_percent", "paper_distance_percent", "against_the_paper",
)  # fmt: skip
_COLOURS = {COHERENCY: "#b42318", MATCHED: "#3366cc"}
_OTHER_COLOUR, _PAPER_COLOUR = "#475467", "#101828"
_STYLES = ("-", "--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)))
_ACROSS = 3


def write_csv(path: Path, attack: Attack, rows: Sequence[Row], command: str) -> None:
    """Write the rows under the command line."""
    notes = (f"level: {attack.level}; right: {attack.counted}; by chance {attack.chance_percent:g} %",)
    write_result_csv(path, command, _COLUMNS, (_fields(row) for row in rows), notes)


def line_of(row: Row) -> str:
    """A row for a terminal."""
    paper = "" if row.paper is None else f", the paper {row.paper.percent:g} {row.against_the_paper}".rstrip()
    extra = "".join(
        f", {name} {value:.2f}{unit}"
        for name, value, unit in (
            ("R2", row.foretold, ""), ("distortion", row.distortion_percent, " %"),
            ("distance", row.distance_percent, " %"),
        )
        if value is not None
    )  # fmt: skip
    return f"{row.attack.name}, {row.arm}, {row.level:g}, {row.reader}: {row.right}{paper}{extra}"


def draw_plot(path: Path, groups: Sequence[Sequence[Row]]) -> None:
    """A panel for each attack; points have exact 95 % intervals, crosses are the paper's."""
    across = min(_ACROSS, len(groups))
    down = -(-len(groups) // across)
    figure = Figure(figsize=(5.2 * across, 4.0 * down), dpi=80, layout="constrained")
    FigureCanvasAgg(figure)
    panels = np.atleast_2d(figure.subplots(down, across)).ravel()
    for panel, rows in zip(panels, groups, strict=False):
        _panel(panel, rows)
    for panel in panels[len(groups) :]:
        panel.set_axis_off()
    save_figure(figure, path, "mtm-hil attacks")


def _panel(axes: Axes, rows: Sequence[Row]) -> None:
    attack = rows[0].attack
    for style, arm in zip(_STYLES, attack.levels, strict=False):
        for reader in dict.fromkeys(row.reader for row in rows):
            own = [row for row in rows if (row.arm, row.reader) == (arm, reader)]
            ends = np.array([row.right.interval_percent for row in own]).T
            percents = np.array([row.right.percent for row in own])
            axes.errorbar(
                _places(attack, own), percents, yerr=np.maximum(0.0, [percents - ends[0], ends[1] - percents]),
                label=f"{reader}, {arm}", color=_COLOURS.get(reader, _OTHER_COLOUR), linestyle=style, marker="o",
                markersize=3, capsize=2, linewidth=1.2,
            )  # fmt: skip
    told = [row for row in rows if row.paper is not None and row.reader == COHERENCY and row.arm == rows[0].arm]
    if told:
        figures = [row.paper.percent for row in told if row.paper is not None]
        axes.plot(_places(attack, told), figures, "x", color=_PAPER_COLOUR, label="the paper's")
    axes.axhline(attack.chance_percent, color="#a9b4c2", linewidth=0.8, linestyle=":")
    axes.set_title(attack.name.replace("_", " "), fontsize=10)
    axes.set_xlabel(attack.level, fontsize=8)
    axes.set_ylabel(f"{attack.counted} (%)", fontsize=8)
    axes.set_ylim(-3.0, 103.0)
    levels = next(iter(attack.levels.values()))
    axes.set_xticks(range(len(levels)), [f"{level:g}" for level in levels], fontsize=8)
    axes.legend(fontsize=6, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)


def _places(attack: Attack, rows: Sequence[Row]) -> list[int]:
    """Levels are drawn evenly spaced, since most grow by factors."""
    return [attack.levels[row.arm].index(row.level) for row in rows]


def _fields(row: Row) -> tuple[object, ...]:
    low, high = row.right.interval_percent
    paper = row.paper
    reported: tuple[object, ...] = ("",) * 5
    if paper is not None:
        reported = (paper.table, f"{paper.percent:g}", f"{paper.margin:g}", *map(_number, (
            paper.distortion_percent, paper.distance_percent)))  # fmt: skip
    return (
        row.arm, f"{row.level:g}", row.reader, row.right.trials, row.right.successes, f"{row.right.percent:.2f}",
        f"{low:.2f}", f"{high:.2f}", *map(_number, (row.margin, row.distortion_percent, row.distance_percent,
        row.foretold)), *reported, row.against_the_paper,
    )  # fmt: skip


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"
