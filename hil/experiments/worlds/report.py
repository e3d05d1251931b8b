"""The worlds' tables for a terminal and for a file, ours beside the paper's."""

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path

from rich.table import Table

from hil.experiments.runs.intervals import clopper_pearson
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.worlds.points import PaperEntry, headline_point
from hil.experiments.worlds.reading import COHERENCY
from hil.experiments.worlds.rollout import NO_MESSAGE, SENT
from hil.experiments.worlds.tables import THROUGH_A_FILE, WRONG_KEY, Row, shortest_ticks

_COLUMNS = (
    "arm", "arrangement", "alphabet_size", "message_ticks", "symbols_per_channel", "detector", "rollouts", "messages",
    "messages_correct", "message_percent", "message_percent_low", "message_percent_high", "symbols", "symbols_correct",
    "symbol_percent", "symbol_percent_low", "symbol_percent_high", "margin", "paper_message_percent",
    "paper_standard_error", "paper_margin", "against_the_paper",
)  # fmt: skip
_REMARKS = Path(__file__).with_name("remarks.toml")
# The paper's table of null conditions (tab:null): percent of symbols right with wrong keys, and without a message.
_PAPER_NULL = {
    "discovery": {WRONG_KEY: 12.10, NO_MESSAGE: 11.75},
    "lunar-lander": {WRONG_KEY: 14.70, NO_MESSAGE: 8.50},
    "reacher": {WRONG_KEY: 13.60, NO_MESSAGE: 10.50},
    "football": {WRONG_KEY: 1.46, NO_MESSAGE: 1.50},
}
# Arms, so that a table fits a terminal of 80 columns.
_SHORT = {SENT: "message", WRONG_KEY: "wrong key", NO_MESSAGE: "nothing", THROUGH_A_FILE: "via file"}
# The paper's Football entries are of 64 strategies with 50 rollouts each and come without an error.
_FOOTBALL_TRIALS = 3200


def against_the_paper(row: Row) -> str:
    """`higher` or `lower` when our interval for the paper's detector does not overlap the paper's, else `agrees`."""
    if row.paper is None or row.goals is None or row.detector != COHERENCY:
        return ""
    low, high = row.goals.interval_percent
    paper_low, paper_high = _paper_interval(row.paper)
    if low > paper_high:
        return "higher"
    return "lower" if high < paper_low else "agrees"


def _paper_interval(entry: PaperEntry) -> tuple[float, float]:
    """95 % interval of an entry, percent: from its standard error, or exact where that is missing."""
    trials = _FOOTBALL_TRIALS if entry.point.world == "football" else 50 * entry.point.goals
    if math.isnan(entry.error):
        low, high = clopper_pearson(round(entry.percent / 100.0 * trials), trials)
        return 100.0 * low, 100.0 * high
    return entry.percent - 1.96 * entry.error, entry.percent + 1.96 * entry.error


def rich_table(world: str, rows: Sequence[Row]) -> Table:
    """Message accuracies (symbol accuracies in the null conditions), detectors side by side."""
    table = Table(
        title=f"{world}: messages right in percent, exact 95 % intervals", box=None, padding=(0, 1, 0, 0),
        pad_edge=False, caption="↑ ↓: better or worse than in the paper by more than both intervals",
    )  # fmt: skip
    detectors = list(dict.fromkeys(row.detector for row in rows))
    for name in ("sent", "on", "M", "T", "n", "paper", *detectors):
        table.add_column(name, justify="left" if name in ("sent", "on") else "right", no_wrap=True)
    groups: dict[tuple[object, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.arm, row.point), []).append(row)
    for group in groups.values():
        first = group[0]
        counted = first.goals or first.symbols
        values = {row.detector: str(row.goals or row.symbols) + _arrow(row) for row in group}
        table.add_row(
            _SHORT[first.arm], first.point.arrangement, str(first.point.alphabet_size), str(first.point.message_ticks),
            str(counted.trials), "" if first.paper is None else f"{first.paper.percent:g}",
            *(values.get(detector, "") for detector in detectors),
        )  # fmt: skip
    return table


def _arrow(row: Row) -> str:
    return {"higher": "↑", "lower": "↓"}.get(against_the_paper(row), "")


def remarks(world: str) -> list[str]:
    """Why results of the world differ from the paper's, one line each."""
    with _REMARKS.open("rb") as file:
        found: list[str] = tomllib.load(file)[world]
    return found


def shortest_messages(rows: Sequence[Row]) -> str:
    """One sentence: the shortest messages that each detector reads as well as the paper's reads the headline."""
    headline = headline_point(rows[0].point.world)
    detectors = list(dict.fromkeys(row.detector for row in rows if row.arm == SENT and row.point == headline))
    parts = [f"{detector} {shortest_ticks(rows, detector) or 'none'}" for detector in detectors]
    return (
        f"shortest messages of {headline.arrangement}, M = {headline.alphabet_size}, read as well as coherency reads "
        f"T = {headline.message_ticks}: T = {', '.join(parts)} (of those measured; Fisher's exact test at 5 %)"
    )


def write_null_csv(path: Path, tables: Sequence[tuple[str, Sequence[Row]]], command: str) -> None:
    """Write the null conditions of all worlds, with whether each interval covers chance, 1 / M."""
    columns = (
        "world", "arm", "arrangement", "alphabet_size", "message_ticks", "detector", "symbols", "symbols_correct",
        "symbol_percent", "symbol_percent_low", "symbol_percent_high", "chance_percent", "covers_chance",
        "paper_symbol_percent",
    )  # fmt: skip
    lines = [_null_row(world, row) for world, rows in tables for row in rows if row.goals is None]
    write_result_csv(path, command, columns, lines)


def _null_row(world: str, row: Row) -> tuple[object, ...]:
    point, chance = row.point, 100.0 / row.point.alphabet_size
    low, high = row.symbols.interval_percent
    reported = _PAPER_NULL[world][row.arm] if point == headline_point(world) else ""
    return (
        world, row.arm, point.arrangement, point.alphabet_size, point.message_ticks, row.detector,
        *_share_fields(row.symbols), f"{chance:.2f}", "yes" if low <= chance <= high else "no", reported,
    )  # fmt: skip


def write_csv(path: Path, rows: Sequence[Row], command: str, notes: Sequence[str]) -> None:
    """Write the rows under the command line and the notes."""
    write_result_csv(path, command, _COLUMNS, (_csv_row(row) for row in rows), notes)


def _csv_row(row: Row) -> tuple[object, ...]:
    point, paper = row.point, row.paper
    reported = ("", "", "") if paper is None else tuple(map(_or_nothing, (paper.percent, paper.error, paper.margin)))
    return (
        row.arm, point.arrangement, point.alphabet_size, point.message_ticks, point.symbols, row.detector, row.rollouts,
        *(("",) * 5 if row.goals is None else _share_fields(row.goals)), *_share_fields(row.symbols),
        "" if row.margin is None else f"{row.margin:.4f}", *reported, against_the_paper(row),
    )  # fmt: skip


def _share_fields(proportion: Proportion) -> tuple[object, ...]:
    low, high = proportion.interval_percent
    return (proportion.trials, proportion.successes, *(f"{value:.2f}" for value in (proportion.percent, low, high)))


def _or_nothing(value: float) -> str:
    return "" if math.isnan(value) else f"{value:g}"
