"""The timing that all positions of a message but one show.

Under the rolling schedule every window has a waveform of its own. What windows of other positions say of the timing is
then independent of a position's wrong candidates, and a candidate that is weighed at their timing pays for no search.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax, logsumexp

from mtm_audit.detectors.matched.candidates import Tones, stacked_tones
from mtm_audit.detectors.matched.coherent import Question, coherent_evidence
from mtm_audit.detectors.matched.correlate import Heard, Prepared, evidence_by_lag, hear
from mtm_audit.detectors.matched.search import lead_cells, waveform_sets
from mtm_audit.detectors.matched.windows import shown_numbers
from mtm_audit.model.timing import OnsetRange, Timing
from mtm_audit.model.track import Bools, Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel

# Starts that are weighed with one set of gains for all windows: the best where each window has its own.
_WEIGHED = 256
# Evidence is taken for half of what it says: it knows one plant, and the starts that are weighed were chosen.
_TEMPER = 0.5
# Other positions are believed so much of the timing at the most.
_MOST_SURE = 0.9
# A start's own weight, and the rest that is spread over so many half cells to either side: a robot's plant delays.
_KEPT, _SPREAD = 0.5, 4
# Log weight from which on a timing costs less than a search.
_COVERS = np.log(1.0 / 32.0)
# Half cells that a neighbourhood reaches to either side.
_REACH = 4


@dataclass(frozen=True)
class Told:
    """`sure`: how far other positions are to be believed; `timings`, each with its log weight, of sum 1 at the most.

    `covers` when the timing that was found is near one of these that has some weight, so that paying for its search
    would add nothing.
    """

    sure: float
    timings: tuple[tuple[Timing, float], ...]
    covers: bool


@dataclass(frozen=True)
class _Said:
    """Starts in half cells from the motion's first, (starts,), and their log probabilities."""

    half_cells: NDArray[np.int64]
    log_shares: Floats


@dataclass(frozen=True)
class OtherPositions:
    """A channel's motion and waveforms, for a start within `bounds` at the nominal rate."""

    codebook: Codebook
    channel: Channel
    prepared: Prepared
    bounds: OnsetRange
    _said: dict[int, _Said] = field(default_factory=dict, repr=False, compare=False)

    def told(self, position: int, found: Timing, numbers: NDArray[np.int64]) -> Told:
        """What all windows but those of the message's `position` say of the likeliest timing and of the one near
        `found`, as far as just the windows `numbers` are seen at them.

        Weights follow from those windows alone, and so does which windows a timing shows.
        """
        if position not in self._said:
            self._said[position] = self._weighed(position)
        said = self._said[position]
        best = int(said.half_cells[np.argmax(said.log_shares)])
        near = np.abs(said.half_cells - best) <= _REACH
        sure = min(_MOST_SURE, float(np.exp(logsumexp(said.log_shares[near]))))
        nearest = self._nearest(found, numbers)
        weighed = {centre: (self._timing(centre), _log_weight(said, centre)) for centre in (best, nearest)}
        shown = {centre: each for centre, each in weighed.items() if self._shows(each[0], numbers)}
        covers = nearest in shown and weighed[nearest][1] > _COVERS
        return Told(sure, tuple(shown.values()), covers)

    def _weighed(self, position: int) -> _Said:
        scheme, starts = self.codebook.scheme, self._starts
        carried = scheme.first_position(self.channel) + np.arange(len(self._tones)) % self.channel.symbols
        apart = carried != position
        promising = np.sort(np.argsort(-starts.evidence[:, apart].sum(axis=1), kind="stable")[:_WEIGHED])
        # The first window's power stands for that of all; it must not be the position's own.
        usual = self._tones[int(np.argmax(apart))]
        tones = [own if told else usual for own, told in zip(self._tones, apart, strict=True)]
        question = Question(tones, starts.lags[promising], starts.inside[promising] & apart)
        (said,) = coherent_evidence(self._heard, [question], self.prepared.motion.step_s)
        return _Said(starts.half_cells[promising], np.asarray(log_softmax(_TEMPER * said)))

    def _timing(self, half_cells: int) -> Timing:
        motion = self.prepared.motion
        return Timing(motion.start_s + 0.5 * half_cells * motion.step_s, self.codebook.scheme.rate_hz)

    def _nearest(self, found: Timing, numbers: NDArray[np.int64]) -> int:
        """The start at the nominal rate at which the middle window begins when it does so at `found`."""
        scheme, motion = self.codebook.scheme, self.prepared.motion
        before = int(numbers[len(numbers) // 2]) * scheme.window_ticks(self.channel)
        onset_s = found.onset_s + before / found.rate_hz - before / scheme.rate_hz
        return round((onset_s - motion.start_s) / (0.5 * motion.step_s))

    def _shows(self, timing: Timing, numbers: NDArray[np.int64]) -> bool:
        """Whether just these windows are seen at that timing."""
        shown = shown_numbers(self.codebook, self.channel, self.prepared.motion, timing, self.bounds)
        return np.array_equal(shown, numbers)

    @cached_property
    def _tones(self) -> list[Tones]:
        count = waveform_sets(self.codebook.scheme, self.channel, self.prepared.motion, self.bounds)
        return [stacked_tones(self.codebook, self.channel, number) for number in range(count)]

    @cached_property
    def _heard(self) -> Heard:
        return hear(self.prepared, self.codebook, self.channel, self.codebook.scheme.rate_hz, self._lead)

    @property
    def _lead(self) -> int:
        return lead_cells(self.codebook.scheme, self.channel, self.prepared.motion, self.bounds)

    @cached_property
    def _starts(self) -> "_Starts":
        scheme, motion = self.codebook.scheme, self.prepared.motion
        # Whole cells, so that nothing that was heard needs to be turned.
        first = np.floor((self.bounds.low_s - motion.start_s) / motion.step_s)
        count = int(np.ceil((self.bounds.high_s - self.bounds.low_s) / motion.step_s)) + 2
        cells = first + np.arange(count)
        length = scheme.window_ticks(self.channel) / scheme.rate_hz / motion.step_s
        lags = cells[:, None] + np.arange(len(self._tones)) * length + self._lead
        by_lag = evidence_by_lag([self._tones], self._heard)[0]
        last = by_lag.shape[1] - 1
        inside = (lags >= 0) & (lags <= last)
        places = np.clip(np.rint(lags).astype(np.int64), 0, last)
        # A window is played or not at even odds.
        carried = np.logaddexp(0.0, np.take_along_axis(by_lag.T, places, axis=0)) - np.log(2.0)
        return _Starts(np.rint(2.0 * cells).astype(np.int64), lags, inside, np.where(inside, carried, 0.0))


def _log_weight(said: _Said, centre: int) -> float:
    """Log weight of a start: its own and its neighbours' probabilities, a part of each."""
    away = np.abs(said.half_cells - centre)
    parts = np.where(away == 0, _KEPT, np.where(away <= _SPREAD, (1.0 - _KEPT) / (2 * _SPREAD), 0.0))
    return float(logsumexp(said.log_shares, b=parts))


@dataclass(frozen=True)
class _Starts:
    """When the first window begins, `half_cells` (starts,) after the motion; where each window does, `lags` (starts,
    windows) in cells of what was heard, which are `inside`, and the log `evidence` of each by itself.
    """

    half_cells: NDArray[np.int64]
    lags: Floats
    inside: Bools
    evidence: Floats
