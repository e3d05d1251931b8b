"""Families of schemes: everything that can be chosen once strategy and alphabet are.

A family says, for message lengths T in ascending order, the best log accuracy that any of its schemes has.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from mtm_audit.model.track import Floats
from mtm_audit.planning.allocation import best_allocation, best_log_accuracies
from mtm_audit.planning.curve import Curve, Integers

Strategy = Literal["single", "same", "split"]

_CHUNK = 1024


class Family(Protocol):
    """What a search needs of a family."""

    @property
    def strategy(self) -> Strategy:
        """How channels are used."""
        ...

    @property
    def alphabet_size(self) -> int:
        """M."""
        ...

    @property
    def exact(self) -> bool:
        """False where better schemes may have been passed over."""
        ...

    def lengths(self) -> Iterator[tuple[Integers, Floats]]:
        """Message lengths in ticks, ascending, in pieces, with the best log accuracy of each."""
        ...

    def parts(self, message_ticks: int) -> tuple[tuple[Curve, int], ...]:
        """The channels in use in that best scheme of one length, with their numbers of symbols."""
        ...


@dataclass(frozen=True)
class Uniform:
    """One channel, or several that carry the same: all symbols in equal windows."""

    strategy: Strategy
    alphabet_size: int
    curve: Curve
    symbols: int
    exact: bool = True

    def lengths(self) -> Iterator[tuple[Integers, Floats]]:
        """As in `Family`."""
        logs = self.curve.log_accuracies
        windows = np.flatnonzero(np.isfinite(logs))
        yield self.symbols * windows, self.symbols * logs[windows]

    def parts(self, message_ticks: int) -> tuple[tuple[Curve, int], ...]:
        """As in `Family`."""
        del message_ticks  # the same at every length
        return ((self.curve, self.symbols),)


@dataclass(frozen=True)
class Split:
    """Each channel carries its own part; every subset and allocation is considered."""

    alphabet_size: int
    curves: tuple[Curve, ...]
    symbols: int
    strategy: Strategy = "split"
    exact: bool = True

    def lengths(self) -> Iterator[tuple[Integers, Floats]]:
        """As in `Family`."""
        logs = [curve.log_accuracies for curve in self.curves]
        candidates = split_lengths(self.curves, self.symbols)
        for start in range(0, len(candidates), _CHUNK):
            piece = candidates[start : start + _CHUNK]
            yield piece, best_log_accuracies(logs, self.symbols, piece)

    def parts(self, message_ticks: int) -> tuple[tuple[Curve, int], ...]:
        """As in `Family`."""
        allocation = best_allocation([curve.log_accuracies for curve in self.curves], self.symbols, message_ticks)
        return in_use(self.curves, allocation)


def in_use(curves: Sequence[Curve], allocation: Sequence[int]) -> tuple[tuple[Curve, int], ...]:
    """The channels that carry anything, with their numbers of symbols."""
    return tuple((curve, count) for curve, count in zip(curves, allocation, strict=True) if count)


def split_lengths(curves: Sequence[Curve], symbols: int) -> Integers:
    """Every T at which two channels or more could share the symbols."""
    ticks = np.unique(np.concatenate([np.flatnonzero(np.isfinite(curve.log_accuracies)) for curve in curves]))
    if not len(ticks):
        return ticks
    # Two channels take part at least, and neither's windows may be longer than the longest.
    first, last = int(ticks[0]), int(ticks[-1]) * symbols // 2
    if curves[0].measured_only:
        lengths = np.unique(np.outer(ticks, np.arange(1, symbols)))
        return lengths[lengths <= last]
    return np.arange(first * -(-symbols // len(curves)), last + 1)
