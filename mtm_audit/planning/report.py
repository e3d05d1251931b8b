"""A plan in words and as a table."""

from collections.abc import Iterator, Sequence

from rich.table import Table

from mtm_audit.planning.check import Checked
from mtm_audit.planning.correction import coded
from mtm_audit.planning.plan import Plan, Problem, fastest_of, is_carried
from mtm_audit.planning.search import EXACT_SYMBOLS, Found, families, most_accurate
from mtm_audit.planning.table import AccuracyTable

_CORRECTED = (1, 2, 3)


def rich_table(found: Sequence[Found], problem: Problem, rate_hz: float) -> Table:
    """One line a strategy."""
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False)
    for name in ("scheme", "M", "L", "T", "seconds", "bits/s", "accuracy", "95 % interval", "symbols x ticks", ""):
        table.add_column(name, justify="left" if name in ("scheme", "symbols x ticks", "") else "right", no_wrap=True)
    for one in found:
        if one.plan is None:
            table.add_row(one.strategy, *[""] * 8, _missing(one))
            continue
        plan, seconds = one.plan, one.plan.message_ticks / rate_hz
        low, high = plan.interval
        note = "" if one.meets_target else "below the target" if is_carried(plan, problem) else "too few trials"
        table.add_row(
            one.strategy, str(plan.alphabet_size), str(plan.symbols), str(plan.message_ticks), f"{seconds:.2f}",
            f"{problem.payload_bits / seconds:.3g}", f"{plan.accuracy:.3f}", f"{low:.3f}-{high:.3f}",
            allocation_text(plan), note,
        )  # fmt: skip
    return table


def allocation_text(plan: Plan) -> str:
    """Such as `x 2 x 288, y 3 x 192`: symbols and window ticks of each channel."""
    windows = plan.window_ticks
    return ", ".join(f"{name} {count} x {windows[name]}" for name, count in plan.allocation.items())


def headline(found: Sequence[Found], problem: Problem, rate_hz: float) -> str:
    """The fastest scheme in one line."""
    plan = fastest(found)
    surely = " surely" if problem.sure else ""
    return (
        f"fastest for {problem.payload_bits} bits at {problem.target_accuracy:g}{surely}: {plan.strategy}, "
        f"M = {plan.alphabet_size}, T = {plan.message_ticks} ({plan.message_ticks / rate_hz:.2f} s)"
    )


def fastest(found: Sequence[Found]) -> Plan:
    """The fastest plan of all strategies; there is one, or `search` would have raised."""
    return fastest_of([one.plan for one in found if one.plan is not None and one.meets_target])


def remarks(table: AccuracyTable, problem: Problem, found: Sequence[Found]) -> Iterator[str]:
    """What a reader of the table should know: interpolation, heuristics, what was not measured."""
    between = [one.strategy for one in found if one.plan is not None and not one.plan.is_measured]
    if between:
        yield f"{', '.join(between)}: windows lie between measured ones, so the accuracy is interpolated"
    for one in found:
        if one.plan is not None and one.meets_target and one.plan.interval[0] < problem.target_accuracy:
            yield (
                f"{one.strategy}: its interval begins at {one.plan.interval[0]:.3f}, below the target; --sure plans "
                "so that it begins there, and more trials make it narrower"
            )
    if any(one.plan is not None and not one.plan.exact for one in found):
        yield f"split: over {EXACT_SYMBOLS} symbols, so shared out by capacity; a faster split may exist"
    for alphabet_size in problem.alphabet_sizes or table.alphabet_sizes:
        lacking = [name for name in table.channels if not table.points_of(name, alphabet_size)]
        if lacking:
            yield f"M = {alphabet_size} was not measured on {', '.join(lacking)}"


def corrections(table: AccuracyTable, problem: Problem, found: Sequence[Found], rate_hz: float) -> Iterator[str]:
    """For each plan, what a Reed-Solomon code would cost and bring, beside longer windows in the same time."""
    every = families(table, problem)
    for one in found:
        if one.plan is None:
            continue
        own = [family for family in every if family.strategy == one.strategy]
        options = [option for errors in _CORRECTED if (option := coded(one.plan, problem.payload_bits, errors))]
        if not options:
            yield f"{one.strategy}: no Reed-Solomon code fits M = {one.plan.alphabet_size}, which is no power of two"
            continue
        # More parity costs more time, so the first that lifts the plan is the one to weigh.
        option = next((this for this in options if this.accuracy > one.plan.accuracy), options[0])
        plain = most_accurate(own, option.message_ticks)
        longer = one.plan.accuracy if plain is None else plain.accuracy
        code = option.code
        yield (
            f"{one.strategy}: RS({code.length},{code.data}) over GF({1 << code.field_bits}), which corrects "
            f"{code.errors}, would take T = {option.message_ticks} ({option.message_ticks / rate_hz:.2f} s) and give "
            f"{option.accuracy:.3f}; longer windows in that time give {longer:.3f} without a code"
        )


def check_lines(found: Sequence[Found], checks: Sequence[Checked]) -> Iterator[str]:
    """For each plan, prediction beside measurement, or that the held-out table does not have its windows."""
    by_strategy = {checked.plan.strategy: checked for checked in checks}
    for one in found:
        if one.strategy in by_strategy:
            yield _check_text(by_strategy[one.strategy])
        elif one.plan is not None:
            yield f"{one.strategy}: not checked, since the held-out table does not have its windows"


def _check_text(checked: Checked) -> str:
    plan, measured = checked.plan, checked.measured
    basis = "at exactly these windows" if measured.is_measured else "interpolated"
    return (
        f"{plan.strategy}: predicted {plan.accuracy:.3f} [{plan.interval[0]:.3f}-{plan.interval[1]:.3f}], held-out "
        f"{measured.accuracy:.3f} [{measured.interval[0]:.3f}-{measured.interval[1]:.3f}] {basis}: "
        + _agreement(checked)
    )


def _agreement(checked: Checked) -> str:
    if not checked.agrees:
        return "the intervals do NOT agree"
    if checked.measured.interval[0] > checked.plan.interval[1]:
        return "more than predicted, as noise that is shaped for these robots may be"
    return "the intervals agree"


def _missing(one: Found) -> str:
    if one.strategy == "same":
        return "the table has no pooled channels, such as x+y"
    return "needs two symbols and two channels with the same M"
