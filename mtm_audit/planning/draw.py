"""Accuracy over message length, one line a strategy."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mtm_audit.model.track import Floats
from mtm_audit.planning.family import Family, Strategy
from mtm_audit.planning.plan import Problem
from mtm_audit.planning.search import Found, families, frontier
from mtm_audit.planning.table import AccuracyTable
from mtm_audit.reporting.figure_file import save_figure
from mtm_audit.reporting.plot import check_plot_path

_COLOURS: dict[Strategy, str] = {"single": "#b42318", "same": "#3366cc", "split": "#1e7a3a"}
_LABELS: dict[Strategy, str] = {"single": "single channel", "same": "same message", "split": "split message"}
# How far beyond the slowest plan the lines go.
_BEYOND = 1.5


def draw_plan(table: AccuracyTable, problem: Problem, found: Sequence[Found], rate_hz: float, path: Path) -> None:
    """Draw the best predicted accuracy of each strategy within T, and the plans with their intervals.

    Raises MtmError as `check_plot_path` does; the picture appears whole or not at all.
    """
    check_plot_path(path)
    every = families(table, problem)
    longest = _BEYOND * max(one.plan.message_ticks for one in found if one.plan is not None)
    figure = Figure(figsize=(8.0, 5.0), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for one in found:
        if one.plan is None:
            continue
        ticks, accuracies = _best_within([family for family in every if family.strategy == one.strategy], longest)
        colour = _COLOURS[one.strategy]
        axes.step(ticks, accuracies, where="post", color=colour, label=_LABELS[one.strategy], linewidth=1.5)
        low, high = one.plan.interval
        here = one.plan.accuracy
        axes.errorbar(
            [one.plan.message_ticks], [here], yerr=[[max(0.0, here - low)], [max(0.0, high - here)]],
            color=colour, marker="o" if one.meets_target else "x", capsize=3,
        )  # fmt: skip
    axes.axhline(problem.target_accuracy, color="#475467", linewidth=0.8, linestyle=":")
    axes.set_xlabel(f"T, ticks of {1000.0 / rate_hz:g} ms")
    axes.set_ylabel("predicted message accuracy")
    axes.set_ylim(-0.03, 1.03)
    axes.set_title(f"{problem.payload_bits} bits, target {problem.target_accuracy:g}", fontsize=11)
    axes.legend(loc="lower right", frameon=False)
    axes.grid(axis="y", color="#e4e7ec", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    save_figure(figure, path, "mtm-audit plan")


def _best_within(every: Sequence[Family], longest: float) -> tuple[Floats, Floats]:
    """Message lengths, ascending, and the best accuracy of any family in at most that time."""
    pieces = [frontier(family, longest) for family in every]
    ticks = np.concatenate([piece[0] for piece in pieces])
    order = np.argsort(ticks, kind="stable")
    best: Floats = np.exp(np.maximum.accumulate(np.concatenate([piece[1] for piece in pieces])[order]))
    shown = best > 0.0
    return np.append(ticks[order][shown], math.floor(longest)), np.append(best[shown], best[-1])
