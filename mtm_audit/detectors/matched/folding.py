"""Which timings look best window by window: the first look of a search at one coarse rate after another."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.candidates import Tones
from mtm_audit.detectors.matched.correlate import Heard, evidence_by_lag, skimmed_by_lag
from mtm_audit.detectors.matched.hypotheses import Grid, Hypothesis, fold
from mtm_audit.detectors.matched.places import Places

_PEAKS_PER_RATE = 8
# Starts beside a peak of cells that were skimmed.
_BESIDE = (-1, 0, 1)
# What was heard at all rates may take so much while they are compared.
_KEPT_BYTES = 40_000_000


@dataclass(frozen=True)
class Candidate:
    """A hypothesis and the coarse rate in whose grid it stands; where rates were skimmed it may be some way off."""

    coarse: int
    hypothesis: Hypothesis
    rate_hz: float
    skimmed: bool = False


class Folding:
    """What each window says by itself, folded over the recording; `tones` are those of each codebook's windows."""

    def __init__(self, places: Places, tones: Sequence[Sequence[Tones]]) -> None:
        self.places, self.tones = places, tones
        # The nominal rate is asked for twice.
        self._middle: NDArray[np.float32] | None = None
        self._heard: dict[int, Heard] = {}

    def best(self, coarse: int, starts: int, every: int = 1) -> list[list[Candidate]]:
        """Each codebook's best hypotheses near one coarse rate, and the best `starts` at rates of usual clocks.

        With `every` above 1 the rates of so many coarse ones are skimmed; each peak and the starts beside it are told
        in the grid of the coarse rate that is nearest.
        """
        grid = self.places.grid(coarse, every)
        folded = fold(self._evidence(coarse, every), grid, _PEAKS_PER_RATE, starts)
        if every == 1:
            return [[Candidate(coarse, peak, float(grid.rates_hz[peak.rate])) for peak in peaks] for peaks in folded]
        own: dict[int, Grid] = {}
        return [
            [each for peak in peaks for each in self._beside(peak, float(grid.rates_hz[peak.rate]), own)]
            for peaks in folded
        ]

    def heard(self, coarse: int) -> Heard:
        """The motion correlated at a coarse rate, kept where that is cheap: most are asked for twice."""
        if coarse in self._heard:
            return self._heard[coarse]
        heard = self.places.heard(coarse)
        if heard.projections.nbytes * self.places.rates.count <= _KEPT_BYTES:
            self._heard[coarse] = heard
        return heard

    def _evidence(self, coarse: int, every: int) -> NDArray[np.float32]:
        middle = coarse == self.places.rates.middle
        if every > 1:
            return skimmed_by_lag(self.tones, self.heard(coarse), every)
        if middle and self._middle is not None:
            return self._middle
        found = evidence_by_lag(self.tones, self.heard(coarse))
        if middle:
            self._middle = found
        return found

    def _beside(self, peak: Hypothesis, rate_hz: float, grids: dict[int, Grid]) -> list[Candidate]:
        nearest = self.places.rates.nearest(rate_hz)
        if nearest not in grids:
            grids[nearest] = self.places.grid(nearest)
        grid = grids[nearest]
        rate = int(np.argmin(np.abs(grid.rates_hz - rate_hz)))
        starts = {min(max(peak.start + cells, 0), len(grid.starts) - 1) for cells in _BESIDE}
        return [
            Candidate(nearest, Hypothesis(rate, start, peak.evidence), float(grid.rates_hz[rate]), skimmed=True)
            for start in sorted(starts)
        ]
