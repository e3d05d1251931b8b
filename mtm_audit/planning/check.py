"""Whether a prediction holds on a table that was measured on other recordings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mtm_audit.planning.curve import fit_curve
from mtm_audit.planning.plan import Plan
from mtm_audit.planning.table import AccuracyTable
from mtm_onboard.protocol.errors import MtmError


@dataclass(frozen=True)
class Checked:
    """A plan beside what held-out measurements make of the same scheme (`measured`, with its own interval).

    With `at_least` more than was predicted agrees as well: so it is of noise that was shaped after the table.
    """

    plan: Plan
    measured: Plan
    at_least: bool = False

    @property
    def agrees(self) -> bool:
        """Whether the two 95 % intervals of the message's accuracy overlap, or more was measured where that may be."""
        (low, high), (other_low, other_high) = self.plan.interval, self.measured.interval
        return low <= other_high and (self.at_least or other_low <= high)


def check_all(plans: Sequence[Plan], held_out: AccuracyTable, *, at_least: bool = False) -> list[Checked]:
    """Check the plans whose windows the held-out table reaches; raises MtmError when it reaches none."""
    checked: list[Checked] = []
    refusals: list[MtmError] = []
    for plan in plans:
        try:
            checked.append(replace(check(plan, held_out), at_least=at_least))
        except MtmError as refusal:
            refusals.append(refusal)
    if not checked:
        raise refusals[0]
    return checked


def check(plan: Plan, held_out: AccuracyTable) -> Checked:
    """Evaluate the plan's scheme on the held-out table.

    Points of exactly the plan's windows are taken as they are; otherwise the table's own curve is interpolated.
    Raises MtmError that names the windows to measure when the held-out table does not reach them.
    """
    parts = []
    for curve, count in plan.parts:
        window_ticks = plan.message_ticks // count
        points = held_out.points_of(curve.channel, plan.alphabet_size)
        exact = [point for point in points if point.window_ticks == window_ticks]
        own = fit_curve(exact or points, measured_only=bool(exact)) if points else None
        if own is None or not own.exists_at(window_ticks):
            raise MtmError(
                f"the held-out table says nothing of {curve.channel} at M = {plan.alphabet_size} in windows of "
                f"{window_ticks} ticks; measure that cell, or leave out --check"
            )
        parts.append((own, count))
    return Checked(
        plan, Plan(plan.strategy, plan.alphabet_size, plan.message_ticks, tuple(parts), plan.exact)
    )  # fmt: skip
