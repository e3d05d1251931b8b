"""When what was watched is looked at, and what each look costs.

Who looks again and again and stops at the first "decoded" has many chances to be wrong. So instants are fixed
beforehand, whatever is seen, and each look has a weight: half of the threshold is that of the look at a source's own
end, and the look number k has 1 / ((k + 1) (k + 2)) of it. The weights of all looks sum to 1.
"""

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass

from mtm_audit.detectors.matched.windows import LEAST_PART
from mtm_onboard.protocol.scheme import Scheme

_SHORTEST_STEP_S = 0.5
# A look comes when what is watched has become longer by so much, at first and as soon as looks are dear.
_GROWTH = 0.1
_LONGEST_STEP_S = 30.0
# What the look at the end costs, by its weight of a half.
_END_CHOICES = 2


@dataclass(frozen=True)
class Look:
    """A look at everything before `until_s` of the watch; `number` counts from 1, and the last one has 0.

    `choices` is what it counts as: one of so many.
    """

    number: int
    until_s: float
    choices: int


def final_look(until_s: float) -> Look:
    """The look at the end of a source that ends by itself, or at a time that was fixed beforehand."""
    return Look(0, until_s, _END_CHOICES)


class Looks:
    """The looks under a scheme, first to last; instants count from the beginning of the watch.

    The first one comes when a window can be read at all.
    """

    def __init__(self, scheme: Scheme) -> None:
        self._more = _instants(min(scheme.window_ticks(channel) for channel in scheme.channels) / scheme.rate_hz)
        self._instants_s = [next(self._more)]
        self._taken = 0

    def due(self, watched_s: float) -> Look | None:
        """The latest look that is due and was not given yet; those before it are left out, and paid for all the same.

        None when no other is due.
        """
        while self._instants_s[-1] <= watched_s:
            self._instants_s.append(next(self._more))
        number = bisect_right(self._instants_s, watched_s)
        if number <= self._taken:
            return None
        self._taken = number
        return Look(number, self._instants_s[number - 1], (number + 1) * (number + 2))

    @property
    def next_s(self) -> float:
        """When the next look is due."""
        return self._instants_s[self._taken]


def _instants(window_s: float) -> Iterator[float]:
    instant_s = LEAST_PART * window_s
    while True:
        yield instant_s
        instant_s += min(max(_SHORTEST_STEP_S, _GROWTH * instant_s), _LONGEST_STEP_S)
