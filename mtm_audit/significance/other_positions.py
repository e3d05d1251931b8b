"""The timing that all positions of a message but one show.

Under the rolling schedule every window has a waveform of its own. What windows of other positions say of the timing is
then independent of a position's wrong candidates, and a candidate that is weighed at their timing pays for no search.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax, logsumexp

from mtm_audit.detectors.matched.coherent import Question, coherent_evidence
from mtm_audit.detectors.matched.correlate import Heard, Prepared, Tones, evidence_by_lag, hear, stacked_tones
from mtm_audit.detectors.matched.search import lead_cells, waveform_sets
from mtm_audit.detectors.matched.windows import shown_numbers
from mtm_audit.model.timing import OnsetRange, Timing
from mtm_audit.model.track import Bools, Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel

# Starts that are weighed with one set of gains for all windows: the best where each window has its own.
_WEIGHED = 128
# A neighbourhood reaches so many cells to either side of its timing.
_REACH = 2


@dataclass(frozen=True)
class OtherPositions:
    """A channel's motion and waveforms, for a start within `bounds` at the nominal rate."""

    codebook: Codebook
    channel: Channel
    prepared: Prepared
    bounds: OnsetRange
    _found: dict[int, tuple[Timing, float]] = field(default_factory=dict, repr=False, compare=False)

    def timing_without(self, position: int) -> tuple[Timing, float]:
        """The likeliest timing by all windows that do not carry the message's `position`, and its log probability."""
        if position not in self._found:
            self._found[position] = self._timing_without(position)
        return self._found[position]

    def shows(self, timing: Timing, numbers: Sequence[int] | NDArray[np.int64]) -> bool:
        """Whether just these windows are seen at that timing."""
        shown = shown_numbers(self.codebook, self.channel, self.prepared.motion, timing, self.bounds)
        return np.array_equal(shown, numbers)

    def _timing_without(self, position: int) -> tuple[Timing, float]:
        scheme, starts = self.codebook.scheme, self._starts
        carried = scheme.first_position(self.channel) + np.arange(len(self._tones)) % self.channel.symbols
        apart = carried != position
        promising = np.sort(np.argsort(-starts.evidence[:, apart].sum(axis=1), kind="stable")[:_WEIGHED])
        # The first window's power stands for that of all; it must not be the position's own.
        usual = self._tones[int(np.argmax(apart))]
        tones = [own if told else usual for own, told in zip(self._tones, apart, strict=True)]
        question = Question(tones, starts.lags[promising], starts.inside[promising] & apart)
        (said,) = coherent_evidence(self._heard, [question], self.prepared.motion.step_s)
        best = promising[np.argmax(said)]
        near = np.abs(promising - best) <= _REACH
        log_share = min(0.0, float(logsumexp(np.asarray(log_softmax(said))[near])))
        return Timing(float(starts.onsets_s[best]), scheme.rate_hz), log_share

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
        return _Starts(motion.start_s + cells * motion.step_s, lags, inside, np.where(inside, carried, 0.0))


@dataclass(frozen=True)
class _Starts:
    """`onsets_s` (starts,); where each window begins, `lags` (starts, windows) in cells of what was heard, which are
    `inside`, and the log `evidence` of each by itself.
    """

    onsets_s: Floats
    lags: Floats
    inside: Bools
    evidence: Floats
