"""The paper's RoboMaster table and its null conditions (tab:robomaster-indep, tab:null), on the simulated fleet."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from hil.experiments.detectors import paper_figures
from hil.experiments.detectors.paper_figures import PaperFigure
from hil.experiments.detectors.robomaster_rollout import NO_MESSAGE, SENT, WRONG_KEY, decode_rollout, rollout_parameters
from hil.experiments.runs.cells import Cell, CellStore, Values
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep
from hil.plants.mecanum import MecanumParameters

# Wrong keys that try each rollout: with 40 rollouts of four robots as many decodes as in the paper.
DECOYS = 10


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the table; `messages` is None for the null conditions, `margin_error` a standard error."""

    arm: str
    message_ticks: int
    rollouts: int
    symbols: Proportion
    messages: Proportion | None
    margin: float
    margin_error: float
    paper: PaperFigure


def measure(
    plant: MecanumParameters,
    rollouts: int,
    store: CellStore,
    console: Console,
    *,
    conditions: Sequence[tuple[str, int]] | None = None,
    workers: int | None = None,
) -> list[Row]:
    """All rows, or those of the given (arm, T), measured; seeds count from 0."""
    asked = _all_conditions() if conditions is None else conditions
    groups = [[_cell(plant, arm, ticks, seed) for seed in range(rollouts)] for arm, ticks in asked]
    results = run_sweep(decode_rollout, [cell for group in groups for cell in group], store, console, workers)
    return [
        _row(arm, ticks, results[number * rollouts : (number + 1) * rollouts])
        for number, (arm, ticks) in enumerate(asked)
    ]


def _all_conditions() -> list[tuple[str, int]]:
    null = paper_figures.NULL_TICKS
    return [*((SENT, ticks) for ticks in paper_figures.MESSAGE_TICKS), (WRONG_KEY, null), (NO_MESSAGE, null)]


def _cell(plant: MecanumParameters, arm: str, ticks: int, seed: int) -> Cell:
    return Cell("robomaster", rollout_parameters(arm, ticks, plant, DECOYS if arm == WRONG_KEY else 0), seed)


def _row(arm: str, ticks: int, results: Sequence[Values]) -> Row:
    correct = [int(result["correct"]) for result in results]
    decodes = [int(result["decodes"]) for result in results]
    margins = [float(result["margin"]) for result in results]
    whole = sum(one == of for one, of in zip(correct, decodes, strict=True))
    error = float(np.std(margins, ddof=1) / np.sqrt(len(margins))) if len(margins) > 1 else float("nan")
    paper = {SENT: paper_figures.MESSAGE.get(ticks), WRONG_KEY: paper_figures.WRONG_KEY}.get(arm)
    return Row(
        arm=arm, message_ticks=ticks, rollouts=len(results), symbols=Proportion(sum(correct), sum(decodes)),
        messages=Proportion(whole, len(results)) if arm == SENT else None,
        margin=float(np.mean(margins)), margin_error=error, paper=paper or paper_figures.NO_MESSAGE,
    )  # fmt: skip


def rich_table(rows: Sequence[Row]) -> Table:
    """The rows for a terminal, ours beside the paper's."""
    table = Table(
        title=f"RoboMaster, {rows[0].rollouts} rollouts a row; percent with exact 95 % intervals",
        box=None, padding=(0, 1, 0, 0), pad_edge=False,
    )  # fmt: skip
    for name in ("sent", "T", "symbols", "paper", "messages", "paper", "margin", "paper"):
        table.add_column(name, justify="left" if name == "sent" else "right", no_wrap=True)
    for row in rows:
        table.add_row(
            row.arm, str(row.message_ticks), str(row.symbols),
            f"{row.paper.symbol_percent:g}", "" if row.messages is None else str(row.messages),
            _or_nothing(row.paper.message_percent), f"{row.margin:.3f}±{row.margin_error:.3f}",
            _or_nothing(row.paper.margin),
        )  # fmt: skip
    return table


def write_csv(path: Path, rows: Sequence[Row], command: str, notes: Sequence[str]) -> None:
    """Write the rows under the command line and the notes."""
    columns = ("arm", "message_ticks", "rollouts", "symbols", "symbols_correct", "symbol_percent", "symbol_percent_low",
             "symbol_percent_high", "paper_symbol_percent", "messages_correct", "message_percent",
             "message_percent_low", "message_percent_high", "paper_message_percent", "margin",
             "margin_standard_error", "paper_margin")  # fmt: skip
    write_result_csv(path, command, columns, (_csv_row(row) for row in rows), notes)


def _csv_row(row: Row) -> tuple[object, ...]:
    low, high = row.symbols.interval_percent
    messages: tuple[object, ...] = ("", "", "", "")
    if row.messages is not None:
        message_low, message_high = row.messages.interval_percent
        percents = (row.messages.percent, message_low, message_high)
        messages = (row.messages.successes, *(f"{value:.2f}" for value in percents))
    return (
        row.arm, row.message_ticks, row.rollouts, row.symbols.trials, row.symbols.successes,
        *(f"{value:.2f}" for value in (row.symbols.percent, low, high)), f"{row.paper.symbol_percent:g}",
        *messages, _or_nothing(row.paper.message_percent), f"{row.margin:.4f}", f"{row.margin_error:.4f}",
        _or_nothing(row.paper.margin),
    )  # fmt: skip


def _or_nothing(value: float | None) -> str:
    return "" if value is None else f"{value:g}"
