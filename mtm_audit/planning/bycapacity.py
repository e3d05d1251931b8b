"""Splitting a long message by the channels' capacities, where the exact search would take too long."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.model.track import Floats
from mtm_audit.planning.capacity import capacity_shares
from mtm_audit.planning.curve import Curve, Integers
from mtm_audit.planning.family import Strategy, in_use, split_lengths

# Message lengths that are tried: many allocations divide them into whole windows.
_ROUND_TICKS = 60
# The next length tried is at least so much longer: a finer search would gain less than rounding costs.
_STEP = 1.005


@dataclass(frozen=True)
class SplitByCapacity:
    """Each channel carries a part in proportion to its capacity: the paper's heuristic for long messages.

    Capacities are those in windows that an equal allocation would have. Each channel takes the next number of symbols
    above its share that divides T; then channels give back what is not needed, so a few symbols may be spare.
    """

    alphabet_size: int
    curves: tuple[Curve, ...]
    symbols: int
    strategy: Strategy = "split"
    exact: bool = False

    def lengths(self) -> Iterator[tuple[Integers, Floats]]:
        """As in `Family`."""
        logs = [curve.log_accuracies for curve in self.curves]
        candidates = split_lengths(self.curves, self.symbols)
        if not self.curves[0].measured_only:
            candidates = _thinned(candidates[candidates % _ROUND_TICKS == 0])
        for length in candidates:
            allocation = self._allocation(int(length), logs)
            best = -np.inf if allocation is None else _total(logs, allocation, int(length))
            yield np.array([length]), np.array([best])

    def parts(self, message_ticks: int) -> tuple[tuple[Curve, int], ...]:
        """As in `Family`."""
        allocation = self._allocation(message_ticks, [curve.log_accuracies for curve in self.curves])
        return in_use(self.curves, allocation or ())

    def _allocation(self, message_ticks: int, logs: Sequence[Floats]) -> tuple[int, ...] | None:
        """Symbols of each channel, or None when the playable numbers do not add up to the message."""
        equal = max(1, message_ticks * len(self.curves) // self.symbols)
        accuracies = np.array(
            [_nearest_accuracy(curve, log, equal) for curve, log in zip(self.curves, logs, strict=True)]
        )
        wanted = self.symbols * capacity_shares(accuracies, self.alphabet_size)
        choices = [_divisors(log, message_ticks) for log in logs]
        taken = [next((n for n in own if n >= want), own[-1]) for own, want in zip(choices, wanted, strict=True)]
        while (best := self._least_needed(taken, choices, logs, message_ticks)) is not None:
            taken[best] = choices[best][choices[best].index(taken[best]) - 1]
        return tuple(taken) if sum(taken) >= self.symbols and sum(n > 0 for n in taken) > 1 else None

    def _least_needed(
        self, taken: Sequence[int], choices: Sequence[Sequence[int]], logs: Sequence[Floats], message_ticks: int
    ) -> int | None:
        """The channel whose next smaller number of symbols spares most, of those that can give some back."""
        spare = sum(taken) - self.symbols
        gains: dict[int, float] = {}
        for place, (count, own, log) in enumerate(zip(taken, choices, logs, strict=True)):
            number = own.index(count)
            if number and count - own[number - 1] <= spare:
                gains[place] = _log_of(log, own[number - 1], message_ticks) - _log_of(log, count, message_ticks)
        return max(gains, key=gains.__getitem__) if gains else None


def _thinned(lengths: Integers) -> Integers:
    """Ascending lengths without those that are hardly longer than the one kept before."""
    kept: list[int] = []
    for length in lengths.tolist():
        if not kept or length >= _STEP * kept[-1]:
            kept.append(length)
    return np.array(kept, dtype=np.int64)


def _nearest_accuracy(curve: Curve, log: Floats, window_ticks: int) -> float:
    known = np.flatnonzero(np.isfinite(log))
    if not len(known):
        return 1.0 / curve.alphabet_size
    return float(np.exp(log[known[np.argmin(np.abs(known - window_ticks))]]))


def _divisors(log: Floats, message_ticks: int) -> list[int]:
    """Numbers of symbols that the channel could send in that time, 0 among them, ascending."""
    windows = np.flatnonzero(np.isfinite(log))
    fitting = windows[(windows > 0) & (message_ticks % np.maximum(windows, 1) == 0)]
    return [0, *sorted(int(message_ticks // window) for window in fitting)]


def _log_of(log: Floats, count: int, message_ticks: int) -> float:
    return count * float(log[message_ticks // count]) if count else 0.0


def _total(logs: Sequence[Floats], allocation: Sequence[int], message_ticks: int) -> float:
    return sum(_log_of(log, count, message_ticks) for log, count in zip(logs, allocation, strict=True))
