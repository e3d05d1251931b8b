"""Sharing a message's symbols out over channels: the exact best for every message length, by dynamic programming."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.track import Floats
from mtm_audit.planning.curve import Integers


def best_log_accuracies(logs: Sequence[Floats], symbols: int, message_ticks: Integers) -> Floats:
    """The largest log accuracy of a split message for each T; -inf where no allocation can be played.

    `logs[c][t]` is the log symbol accuracy of channel c in windows of t ticks, -inf where it is not known;
    `message_ticks` (lengths,) ascending. A channel with l symbols has windows of T / l ticks, so only divisors of T
    count. At least two channels take part; the search is over every subset and allocation.
    """
    return _stages(logs, symbols, message_ticks)[-1][:, symbols]


def best_allocation(logs: Sequence[Floats], symbols: int, message_ticks: int) -> tuple[int, ...]:
    """Symbols of each channel, in order, that attain `best_log_accuracies` at one T where it is finite."""
    stages = _stages(logs, symbols, np.array([message_ticks]))
    left, allocation = symbols, []
    for channel in range(len(logs) - 1, -1, -1):
        here, before = stages[channel + 1][0], stages[channel][0]
        taken = 0
        if here[left] != before[left]:
            taken = next(
                count for count, value in _choices(logs[channel], symbols, message_ticks)
                if count <= left and before[left - count] + value == here[left]
            )  # fmt: skip
        allocation.append(taken)
        left -= taken
    return tuple(reversed(allocation))


def _stages(logs: Sequence[Floats], symbols: int, message_ticks: Integers) -> list[Floats]:
    """After each channel: best log accuracy of every number of symbols given out so far, (lengths, symbols + 1)."""
    nothing = np.full((len(message_ticks), symbols + 1), -np.inf)
    nothing[:, 0] = 0.0
    stages = [nothing]
    for log in logs:
        before = stages[-1]
        after = before.copy()
        # A channel that took all symbols would be a single-channel scheme.
        for count in range(1, symbols):
            rows, values = _rows(log, count, message_ticks)
            if len(rows):
                offered = before[rows, : symbols + 1 - count] + values[:, None]
                after[rows, count:] = np.maximum(after[rows, count:], offered)
        stages.append(after)
    return stages


def _rows(log: Floats, count: int, message_ticks: Integers) -> tuple[NDArray[np.intp], Floats]:
    """Which T give the channel windows that it can play `count` of, and the log accuracy of all of them."""
    first, last = np.searchsorted(message_ticks, (count, count * (len(log) - 1) + 1))
    windows, rest = np.divmod(message_ticks[first:last], count)
    inside = np.flatnonzero(rest == 0)
    values = log[windows[inside]]
    known = np.flatnonzero(np.isfinite(values))
    return first + inside[known], count * values[known]


def _choices(log: Floats, symbols: int, message_ticks: int) -> list[tuple[int, float]]:
    pairs = []
    for count in range(1, symbols):
        rows, values = _rows(log, count, np.array([message_ticks]))
        pairs += [(count, float(value)) for value in values[: len(rows)]]
    return pairs
