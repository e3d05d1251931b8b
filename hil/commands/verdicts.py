"""`mtm-hil verdicts`: whether verdicts hold what they promise, and how much they read."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from hil.experiments.runs.cells import CellStore, Values
from hil.experiments.runs.intervals import clopper_pearson
from hil.experiments.runs.result_file import write_result_csv
from hil.experiments.runs.sweep import run_sweep
from hil.experiments.verdicts.hostile import KINDS
from hil.experiments.verdicts.power import (
    CONDITIONS,
    PowerSummary,
    decode_job,
    power_cells,
    smallest_decoded,
    summarise_power,
)
from hil.experiments.verdicts.sure import PLANTS, SureSummary, decode_sent, summarise_sure, sure_cells
from hil.experiments.verdicts.thresholds import THRESHOLDS
from hil.experiments.verdicts.validity import (
    LEVELS,
    ValiditySummary,
    decode_under_keys,
    summarise_validity,
    validity_cells,
)
from hil.experiments.verdicts.watched import SECONDS, summarise_watched, watch_silent, watched_cells
from mtm_onboard.protocol.errors import WrongValueError

Row = tuple[object, ...]

_VALIDITY_COLUMNS = (
    "kind", "recordings", "keys", "refused", "decoded", "inconclusive", "not_finite", "mean_e", "mean_e_error",
    "mean_symbol_e", "mean_symbol_e_error", "most_bits", "level", "below", "low", "high",
)  # fmt: skip
_WATCHED_COLUMNS = (
    "streams", "seconds", "looks", "weighed", "decoded", "low", "high", "inconclusive", "most_bits",
)  # fmt: skip
_SURE_COLUMNS = (
    "plant", "threshold", "messages", "wrong", "wrong_low", "wrong_high", "right", "right_low", "right_high",
    "inconclusive", "absent", "likeliest_right_but_absent", "refused",
)  # fmt: skip
_POWER_COLUMNS = (
    "condition", "ticks", "threshold", "rollouts", "decoded", "low", "high", "wrong", "inconclusive", "absent",
    "likeliest_right", "likeliest_right_but_absent",
)  # fmt: skip


@dataclass(frozen=True)
class VerdictOptions:
    """What the command line asked for; `names` are the kinds or plants to measure, all when empty."""

    count: int
    names: tuple[str, ...]
    seed: int
    workers: int | None
    out: Path | None
    cells: Path


def known_names(asked: Iterable[str], known: Iterable[str]) -> tuple[str, ...]:
    """The names asked for; raises MtmError for one that is not known."""
    names, choices = tuple(asked), tuple(known)
    for name in names:
        if name not in choices:
            raise WrongValueError(f"there is no {name!r} to measure; choose from: {'; '.join(choices)}")
    return names


def validity(options: VerdictOptions, recordings: int, console: Console) -> None:
    """Measure, print and, where asked, write how p-values and e-values are spread under keys that nobody played, on so
    many recordings of every kind.
    """
    rows: list[Row] = []
    everything: list[Values] = []
    kinds = options.names or tuple(KINDS)
    with CellStore(options.cells) as store:
        for kind in kinds:
            asked = validity_cells(kind, recordings, options.count, options.seed)
            results = run_sweep(decode_under_keys, asked, store, console, options.workers)
            everything += results
            rows += _validity_rows(summarise_validity(kind, results), recordings)
    rows += _validity_rows(summarise_validity("all", everything), recordings * len(kinds))
    _write("validity", options, _VALIDITY_COLUMNS, rows, asked=f" --recordings {recordings}")


def sure(options: VerdictOptions, console: Console) -> None:
    """Measure, print and, where asked, write how often messages are decoded, right and wrong, on strange vehicles."""
    rows: list[Row] = []
    with CellStore(options.cells) as store:
        for plant in options.names or PLANTS:
            asked = sure_cells(plant, options.count, options.seed)
            results = run_sweep(decode_sent, asked, store, console, options.workers)
            rows += [_sure_row(summary) for summary in summarise_sure(plant, results)]
    _write("sure", options, _SURE_COLUMNS, rows)


def power(options: VerdictOptions, console: Console) -> None:
    """Measure, print and, where asked, write how often the paper's job is decoded."""
    summaries: list[PowerSummary] = []
    with CellStore(options.cells) as store:
        for condition in CONDITIONS:
            for ticks in condition.ticks:
                asked = power_cells(condition, ticks, options.count, options.seed)
                results = run_sweep(decode_job, asked, store, console, options.workers)
                summaries += summarise_power(condition, ticks, results)
    rows = [_power_row(summary) for summary in summaries]
    notes = []
    for condition in CONDITIONS:
        if len(condition.ticks) > 1:
            shortest = [str(smallest_decoded(summaries, condition.name, threshold)) for threshold in THRESHOLDS]
            at = ", ".join(f"{threshold:g}" for threshold in THRESHOLDS)
            notes.append(
                f"{condition.name}: smallest T from which on most rollouts are decoded at {at}: {', '.join(shortest)}"
            )
    print("\n".join(notes))
    _write("power", options, _POWER_COLUMNS, rows, notes)


def _validity_rows(summary: ValiditySummary, recordings: int) -> list[Row]:
    print(
        f"{summary.kind}: {summary.keys} keys on {recordings} recordings, {summary.decoded} decoded, "
        f"{summary.inconclusive} inconclusive, {summary.refused} refused, {summary.not_finite} not finite; mean e "
        f"{summary.mean_e:.4f} +- {summary.mean_e_error:.4f}, of a symbol {summary.mean_symbol_e:.4f} +- "
        f"{summary.mean_symbol_e_error:.4f}, at most {summary.most_bits:.1f} bits"
    )
    rows: list[Row] = []
    for level, below in zip(LEVELS, summary.below, strict=True):
        low, high = _interval(below, summary.keys)
        print(f"  p <= {level:g}: {below}, 95 % interval {low:.5f} to {high:.5f}")
        rows.append(
            (summary.kind, recordings, summary.keys, summary.refused, summary.decoded, summary.inconclusive,
             summary.not_finite, f"{summary.mean_e:.6g}", f"{summary.mean_e_error:.3g}", f"{summary.mean_symbol_e:.6g}",
             f"{summary.mean_symbol_e_error:.3g}", f"{summary.most_bits:.2f}", level, below, f"{low:.6f}",
             f"{high:.6f}")
        )  # fmt: skip
    return rows


def _sure_row(summary: SureSummary) -> Row:
    count = summary.messages
    wrong, right = _interval(summary.wrong, count), _interval(summary.right, count)
    print(
        f"{summary.plant} at {summary.threshold:g}: of {count} messages {summary.right} decoded right and "
        f"{summary.wrong} wrong (95 % interval {wrong[0]:.5f} to {wrong[1]:.5f}), {summary.inconclusive} inconclusive, "
        f"{summary.absent} absent, {summary.likeliest_absent} of these with the right symbols"
    )
    return (
        summary.plant, summary.threshold, count, summary.wrong, f"{wrong[0]:.5f}", f"{wrong[1]:.5f}", summary.right,
        f"{right[0]:.5f}", f"{right[1]:.5f}", summary.inconclusive, summary.absent, summary.likeliest_absent,
        summary.refused,
    )  # fmt: skip


def _power_row(summary: PowerSummary) -> Row:
    low, high = _interval(summary.decoded, summary.rollouts)
    print(
        f"{summary.condition}, T = {summary.ticks}, at {summary.threshold:g}: {summary.decoded} of {summary.rollouts} "
        f"decoded (95 % interval {low:.3f} to {high:.3f}), {summary.wrong} of them wrong, {summary.inconclusive} "
        f"inconclusive, {summary.absent} absent; likeliest symbols right {summary.likeliest}, absent of these "
        f"{summary.likeliest_absent}"
    )
    return (
        summary.condition, summary.ticks, summary.threshold, summary.rollouts, summary.decoded, f"{low:.5f}",
        f"{high:.5f}", summary.wrong, summary.inconclusive, summary.absent, summary.likeliest,
        summary.likeliest_absent,
    )  # fmt: skip


def watched(options: VerdictOptions, console: Console) -> None:
    """Print and, where asked, write what watching silent robots gave."""
    with CellStore(options.cells) as store:
        cells = watched_cells(options.count, options.seed)
        summary = summarise_watched(run_sweep(watch_silent, cells, store, console, options.workers))
    low, high = _interval(summary.decoded, summary.streams)
    print(
        f"{summary.streams} silent streams of {SECONDS:g} s, {summary.looks} looks, {summary.weighed} of these more "
        f"than a glance: {summary.decoded} decoded (95 % interval {low:.5f} to {high:.5f}), {summary.inconclusive} "
        f"inconclusive, at most {summary.most_bits:.1f} bits"
    )
    row = (
        summary.streams, f"{SECONDS:g}", summary.looks, summary.weighed, summary.decoded, f"{low:.6f}", f"{high:.6f}",
        summary.inconclusive, f"{summary.most_bits:.2f}",
    )  # fmt: skip
    _write("watched", options, _WATCHED_COLUMNS, [row])


def _interval(successes: int, trials: int) -> tuple[float, float]:
    return clopper_pearson(successes, trials) if trials else (0.0, 1.0)


def _write(
    arm: str,
    options: VerdictOptions,
    columns: Sequence[str],
    rows: Sequence[Row],
    notes: Sequence[str] = (),
    asked: str = "",
) -> None:
    """`asked` are options of this arm alone, as the command line says them."""
    if options.out is None:
        return
    only = "".join(f' --only "{name}"' for name in options.names)
    command = f"mtm-hil verdicts {arm} -n {options.count}{asked}{only} --seed {options.seed} --out {options.out}"
    write_result_csv(options.out, command, columns, rows, notes)
    print(f"wrote {options.out}")
