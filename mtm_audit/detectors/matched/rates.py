"""The coarse clock rates that a search tries, and their order: usual clocks first, others where those show nothing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

# Window by window a weak message is lost among starts; at usual rates so many are weighed whatever they look like.
_USUAL_STARTS = 128
USUAL_RATES = 0.03
_PLAIN_NATS = 20.0
# Of the distance between coarse rates; half of it is where the next one's begin.
_NEAR_NOMINAL = 0.25

_Best = TypeVar("_Best")


@dataclass(frozen=True)
class Sweep:
    """One round of a search: the `numbers` of its coarse rates, how many `starts` are weighed at usual rates whatever
    they look like, and that only one in `every` rates, and cells, is looked at.
    """

    numbers: Sequence[int]
    starts: int
    every: int = 1


@dataclass(frozen=True)
class Told:
    """A result's evidence, its coarse rate's number and its rate."""

    evidence: float
    coarse: int
    rate_hz: float


@dataclass(frozen=True)
class Rates:
    """The coarse rates: `count` of them, the nominal one in the middle, relative `spacing` apart."""

    count: int
    spacing: float
    nominal_hz: float

    @property
    def middle(self) -> int:
        """The number of the nominal rate."""
        return self.count // 2

    def nearest(self, rate_hz: float) -> int:
        """The number of the coarse rate that is nearest to a rate."""
        far = round((rate_hz / self.nominal_hz - 1.0) / self.spacing)
        return min(max(self.middle + far, 0), self.count - 1)

    def usual(self) -> list[int]:
        """The numbers of the rates that usual clocks have."""
        return [at for at in range(self.count) if abs(at - self.middle) * self.spacing <= USUAL_RATES]

    def others(self, every: int = 1) -> list[int]:
        """The numbers of the other rates, one in `every`: so many that no rate is further off than half of that."""
        usual = self.usual()
        return sorted(
            _thinned(list(range(usual[0]))[::-1], every) + _thinned(list(range(usual[-1] + 1, self.count)), every)
        )


def _thinned(run: list[int], every: int) -> list[int]:
    """One in `every` of neighbouring numbers, and the last where it would be far from all of them."""
    chosen = run[(every - 1) // 2 :: every]
    if run and (not chosen or abs(run[-1] - chosen[-1]) > (every - 1) / 2):
        chosen.append(run[-1])
    return chosen


def usual_first(
    rates: Rates,
    best_of: Callable[[Sweep], list[_Best]],
    told: Callable[[_Best], Told],
    *,
    nominal_first: bool,
    every: int = 1,
) -> list[_Best]:
    """The best of each channel at the coarse rates of usual clocks, and where one does not stand out there, at one in
    `every` of the others.

    With `nominal_first` the nominal rate is tried before that, where a large alphabet peaks.
    """
    if nominal_first:
        best = best_of(Sweep([rates.middle], 0))
        if _plain_at_nominal([told(each) for each in best], rates):
            return best
    best = best_of(Sweep(rates.usual(), _USUAL_STARTS))
    others = rates.others(every)
    if others and not _plain([told(each) for each in best], rates):
        best = [
            max(pair, key=lambda each: told(each).evidence)
            for pair in zip(best, best_of(Sweep(others, _USUAL_STARTS, every)), strict=True)
        ]
    return best


def _plain_at_nominal(best: Sequence[Told], rates: Rates) -> bool:
    """Whether every message stands out near the nominal rate, clear of what the next coarse rate would show better."""
    far = _NEAR_NOMINAL * rates.spacing
    return all(one.evidence > _PLAIN_NATS and abs(one.rate_hz / rates.nominal_hz - 1.0) <= far for one in best)


def _plain(best: Sequence[Told], rates: Rates) -> bool:
    """Whether every message stands out well inside the usual rates: clocks are seldom far off, and then others cannot
    do better.
    """
    return all(
        one.evidence > _PLAIN_NATS and abs(one.coarse - rates.middle) * rates.spacing <= 0.5 * USUAL_RATES
        for one in best
    )
