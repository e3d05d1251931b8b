"""The paper's design procedure: for each strategy the fastest scheme that meets the target."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from mtm_audit.model.track import Floats
from mtm_audit.planning.bycapacity import SplitByCapacity
from mtm_audit.planning.curve import Curve, Integers, fit_curve
from mtm_audit.planning.family import Family, Split, Strategy, Uniform
from mtm_audit.planning.plan import Plan, Problem, fastest_of, is_carried, reaches, symbols_needed
from mtm_audit.planning.table import AccuracyTable
from mtm_onboard.protocol.errors import MtmError

# Symbols up to which every allocation is searched; longer messages are split by capacity.
EXACT_SYMBOLS = 64

STRATEGIES: tuple[Strategy, ...] = get_args(Strategy)
# Products of accuracies that differ by rounding alone count as equal.
_SLACK = 1e-12


@dataclass(frozen=True)
class Found:
    """What one strategy has to offer: a plan that meets the target, or else the most accurate one.

    `plan` is None when the table has nothing for the strategy.
    """

    strategy: Strategy
    plan: Plan | None
    meets_target: bool


def search(table: AccuracyTable, problem: Problem) -> tuple[Found, ...]:
    """The fastest single-, same- and split-message schemes, in this order.

    Raises MtmError when the table lacks an alphabet asked for or when no scheme at all meets the target.
    """
    every = families(table, problem)
    found = tuple(_found(name, [family for family in every if family.strategy == name], problem) for name in STRATEGIES)
    if not any(one.meets_target for one in found):
        raise MtmError(_impossible([one.plan for one in found if one.plan is not None], problem))
    return found


def families(table: AccuracyTable, problem: Problem) -> list[Family]:
    """All families of schemes that the table can predict."""
    unknown = sorted(set(problem.alphabet_sizes or ()) - set(table.alphabet_sizes))
    if unknown:
        known = ", ".join(map(str, table.alphabet_sizes))
        raise MtmError(f"the table has no M = {unknown[0]}; choose of {known}, or measure it")
    found: list[Family] = []
    for alphabet_size in problem.alphabet_sizes or table.alphabet_sizes:
        symbols = symbols_needed(problem.payload_bits, alphabet_size)
        curves = curves_of(table, alphabet_size, measured_only=problem.measured_only)
        plain = tuple(curve for curve in curves if "+" not in curve.channel)
        for curve in curves:
            found.append(Uniform("single" if curve in plain else "same", alphabet_size, curve, symbols))
        if len(plain) > 1 and symbols > 1:
            kind = Split if symbols <= EXACT_SYMBOLS else SplitByCapacity
            found.append(kind(alphabet_size, plain, symbols))
    return found


def curves_of(table: AccuracyTable, alphabet_size: int, *, measured_only: bool) -> tuple[Curve, ...]:
    """A curve for each channel, pooled ones included, that has points for this alphabet."""
    points = [table.points_of(channel, alphabet_size) for channel in table.channels]
    return tuple(fit_curve(own, measured_only=measured_only) for own in points if own)


def most_accurate(every: Sequence[Family], ticks: float = math.inf) -> Plan | None:
    """The plan with the largest accuracy that takes at most so many ticks; None when there is none."""
    plans = []
    for family in every:
        lengths, logs = frontier(family, ticks)
        if len(lengths) and np.isfinite(logs.max()):
            plans.append(_plan(family, int(lengths[np.argmax(logs)])))
    return max(plans, key=lambda plan: (plan.accuracy, -plan.message_ticks), default=None)


def frontier(family: Family, ticks: float = math.inf) -> tuple[Integers, Floats]:
    """All message lengths of a family up to `ticks`, ascending, and the best log accuracy of each."""
    lengths: list[Integers] = [np.zeros(0, dtype=np.int64)]
    logs: list[Floats] = [np.zeros(0)]
    for piece, best in family.lengths():
        lengths.append(piece[piece <= ticks])
        logs.append(best[piece <= ticks])
        if len(piece) and piece[-1] > ticks:
            break
    return np.concatenate(lengths), np.concatenate(logs)


def _found(strategy: Strategy, every: Sequence[Family], problem: Problem) -> Found:
    plans: list[Plan] = []
    for family in every:
        # An equally long one may still be more accurate.
        limit = min((plan.message_ticks for plan in plans), default=math.inf)
        plan = _first_reaching(family, problem, limit)
        if plan is not None:
            plans.append(plan)
    if plans:
        return Found(strategy, fastest_of(plans), meets_target=True)
    return Found(strategy, most_accurate(every), meets_target=False)


def _first_reaching(family: Family, problem: Problem, limit: float) -> Plan | None:
    log_target = math.log(problem.target_accuracy) - _SLACK
    for lengths, logs in family.lengths():
        # The interval's lower end is never above the prediction, so that nothing else can reach the target.
        for place in np.flatnonzero((logs >= log_target) & (lengths <= limit)):
            plan = _plan(family, int(lengths[place]))
            if not is_carried(plan, problem):
                continue
            if not problem.sure or reaches(plan, problem):
                return plan
        if len(lengths) and lengths[-1] > limit:
            return None
    return None


def _plan(family: Family, message_ticks: int) -> Plan:
    return Plan(
        family.strategy, family.alphabet_size, message_ticks, family.parts(message_ticks), family.exact
    )  # fmt: skip


def _impossible(plans: Sequence[Plan], problem: Problem) -> str:
    text = (
        f"no scheme of this table carries {problem.payload_bits} bits with an accuracy of {problem.target_accuracy:g}"
    )
    if not plans:
        return f"{text}, nor with any other; measure longer windows"
    best = max(plans, key=lambda plan: plan.accuracy)
    if best.accuracy >= problem.target_accuracy and not is_carried(best, problem):
        trials = math.ceil(best.symbols / (1.0 - problem.target_accuracy) - 1e-9)
        return (
            f"{text}: there are so few trials that one more error among them would miss the target; measure about "
            f"{trials} or more of each window, or lower the target"
        )
    if problem.sure and best.accuracy >= problem.target_accuracy:
        return (
            f"{text} surely: the interval of the best begins at {best.interval[0]:.3g} (M = {best.alphabet_size}, "
            f"T = {best.message_ticks}); measure more trials or longer windows, lower the target, or leave out --sure"
        )
    return (
        f"{text}: the best has {best.accuracy:.3g} (M = {best.alphabet_size}, T = {best.message_ticks}); lower the "
        "target, shorten the payload, or measure longer windows"
    )
