"""What every detector returns, and the interface behind which all of them stand."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.correlate import Prepared
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.timing import Onset, Timing
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Channel

# How strengths are distributed without a message: as log evidence, or as means of maxima over candidates.
StrengthLaw = Literal["log evidence", "mean of maxima"]


@dataclass(frozen=True)
class Reading:
    """One channel of one recording under one codebook.

    `scores` (positions, M): evidence for each symbol at each of the message's l_c positions, all repeats taken
    together; `window_scores` (windows, M) the same for every window seen, `window_numbers` (windows,) which window from
    the onset on each is (negative ones came before it), `window_positions` (windows,) which position of the message it
    carries, `window_starts_s` (windows,) when it began. `strength` is the single number that a
    verdict compares between the key and its decoys: larger means more evidence of any message at all.
    """

    timing: Timing
    scores: Floats
    window_scores: Floats
    window_numbers: NDArray[np.int64]
    window_positions: NDArray[np.int64]
    window_starts_s: Floats
    strength: float


@dataclass(frozen=True)
class Observation:
    """One channel and the motion of its body."""

    channel: Channel
    glimpse: Glimpse


@dataclass(frozen=True)
class ChannelReading:
    """A channel's reading under the key, with what a message and a verdict need beside it.

    `posteriors` (positions, M): probability of each symbol at each position, given that a message is there;
    `window_ratios` (windows, M): log-likelihood ratios in nats, the same for anything but the symbol;
    `decoy_strengths` (decoys,): the strength that the same search found under keys that nobody holds; `prepared` is
    the motion made ready for evidence, None from a detector that gives none; `alone` and
    `alone_strength` are the timing and strength that the channel's own search found, before others had a say.
    """

    reading: Reading
    posteriors: Floats
    window_ratios: Floats
    decoy_strengths: Floats
    prepared: Prepared | None = None
    alone: Timing | None = None
    alone_strength: float | None = None


class Detector(Protocol):
    """Scores the channels of a recording under a key's codebook and under those of its decoys.

    All codebooks share one scheme. `onset` is when the codebooks' first window began, as far as it is known; everything
    that is searched is searched for each decoy anew.
    """

    name: str
    strength_law: StrengthLaw

    def read(
        self,
        codebook: Codebook,
        decoys: Sequence[Codebook],
        observations: Sequence[Observation],
        onset: Onset,
        progress: Callable[[float], None] | None = None,
    ) -> list[ChannelReading | MtmError]:
        """For each observation its reading, or why it cannot be read (too short for a window)."""
        ...

    def strengths(
        self,
        codebooks: Sequence[Codebook],
        channels: Sequence[Channel],
        glimpses: Sequence[Glimpse],
        onset: Onset,
        *,
        usual_rates: bool = False,
    ) -> Floats:
        """The strength of each channel in each glimpse under each codebook, (codebooks, channels, glimpses).

        NaN where a glimpse cannot be read. Quicker than `read`: to match tracks and channels. With `usual_rates` a
        detector may leave out clocks that are far off.
        """
        ...


def whole_windows(glimpse: Glimpse, timing: Timing, window_ticks: int, *, backwards: bool) -> NDArray[np.int64]:
    """Numbers of the windows that lie inside the recording, counted from the onset; empty when there is none.

    With `backwards` windows before the onset count as well (negative numbers): the message had begun earlier.
    Where no window lies wholly inside, the first one counts if three quarters of it do (a slow candidate rate
    stretches the message beyond a recording that just holds it).
    """
    length_s = window_ticks / timing.rate_hz
    slack_s = 0.1 / timing.rate_hz
    first = int(np.ceil((glimpse.edges_s[0] - slack_s - timing.onset_s) / length_s))
    last = int(np.floor((glimpse.edges_s[-1] + slack_s - timing.onset_s) / length_s))
    windows = np.arange(first if backwards else max(0, first), max(last, first))
    if len(windows):
        return windows
    seen_s = min(glimpse.edges_s[-1], timing.onset_s + length_s) - max(glimpse.edges_s[0], timing.onset_s)
    return np.arange(1) if seen_s >= 0.75 * length_s else np.arange(0)


def combine_repeats(window_scores: Floats, positions: NDArray[np.int64], count: int) -> Floats:
    """Mean over the repeats of each message position: (windows, M) to (count, M); zeros where none was seen."""
    combined = np.zeros((count, window_scores.shape[1]))
    for position in range(count):
        rows = window_scores[positions == position]
        if len(rows):
            combined[position] = rows.mean(axis=0)
    return combined
