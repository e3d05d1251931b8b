"""Plans: schemes that a table predicts, and what is asked of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from mtm_audit.planning.curve import Curve
from mtm_audit.planning.family import Strategy
from mtm_audit.planning.interval import message_interval
from mtm_onboard.protocol.errors import WrongValueError

LONGEST_PAYLOAD_BITS = 1024
# Products of accuracies that differ by rounding alone count as equal.
_SLACK = 1e-12


@dataclass(frozen=True)
class Problem:
    """What a message must carry, and how surely. `alphabet_sizes` None: all that the table has.

    `measured_only` searches the table's own points, unsmoothed, as the paper does. `sure` wants the target of the
    interval's lower end and not of the prediction itself. Raises MtmError on construction.
    """

    payload_bits: int
    target_accuracy: float
    alphabet_sizes: tuple[int, ...] | None = None
    measured_only: bool = False
    sure: bool = False

    def __post_init__(self) -> None:
        if not 1 <= self.payload_bits <= LONGEST_PAYLOAD_BITS:
            raise WrongValueError(
                f"a payload of {self.payload_bits} bits cannot be planned; one message carries 1 to "
                f"{LONGEST_PAYLOAD_BITS}, so send a longer payload in several messages"
            )
        if not 0.0 < self.target_accuracy < 1.0:
            raise WrongValueError(
                f"the target accuracy is {self.target_accuracy:g}; choose one above 0 and below 1, since no number of "
                "trials shows certainty"
            )


@dataclass(frozen=True)
class Plan:
    """One scheme with its predicted accuracy. `parts`: the channels in use with their numbers of symbols l_c.

    With the strategy "same" there is one part, the pooled channels. `exact`: no scheme of its strategy is faster.
    """

    strategy: Strategy
    alphabet_size: int
    message_ticks: int
    parts: tuple[tuple[Curve, int], ...]
    exact: bool

    @property
    def allocation(self) -> dict[str, int]:
        """Symbols by channel name; pooled channels are one name such as `x+y`."""
        return {curve.channel: count for curve, count in self.parts}

    @property
    def window_ticks(self) -> dict[str, int]:
        """Ticks of one symbol, T / l_c, by channel name."""
        return {curve.channel: self.message_ticks // count for curve, count in self.parts}

    @property
    def symbols(self) -> int:
        """L: symbols of the whole message."""
        return sum(count for _, count in self.parts)

    @property
    def accuracy(self) -> float:
        """Predicted share of messages whose every symbol is right: the product of the symbol accuracies."""
        return math.prod(curve.accuracy(self.message_ticks // count) ** count for curve, count in self.parts)

    @cached_property
    def interval(self) -> tuple[float, float]:
        """95 % interval of `accuracy` from the table's sampling error."""
        return message_interval([(curve, self.message_ticks // count, count) for curve, count in self.parts])

    @property
    def finest_error(self) -> float:
        """What one more error among the trials of a window would cost the message's accuracy, at the most."""
        return max(count / curve.trials_at(self.message_ticks // count) for curve, count in self.parts)

    @property
    def is_measured(self) -> bool:
        """Whether all of its windows are points of the table, so that nothing is interpolated."""
        return all(curve.is_measured_at(self.message_ticks // count) for curve, count in self.parts)


def reaches(plan: Plan, problem: Problem) -> bool:
    """Whether a plan has the accuracy that is asked for, by the prediction or surely."""
    return (plan.interval[0] if problem.sure else plan.accuracy) >= problem.target_accuracy - _SLACK


def is_carried(plan: Plan, problem: Problem) -> bool:
    """Whether its trials are so many that one more error among them would not miss the target."""
    return plan.finest_error <= 1.0 - problem.target_accuracy + _SLACK


def symbols_needed(payload_bits: int, alphabet_size: int) -> int:
    """L: the fewest symbols with alphabet_size ** L >= 2 ** payload_bits."""
    symbols = max(1, math.floor(payload_bits / math.log2(alphabet_size)) - 1)
    while alphabet_size**symbols < 1 << payload_bits:
        symbols += 1
    return symbols


def fastest_of(plans: Sequence[Plan]) -> Plan:
    """The plan with the shortest message; of equal ones the most accurate."""
    return min(plans, key=lambda plan: (plan.message_ticks, -plan.accuracy))
