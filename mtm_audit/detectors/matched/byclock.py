"""Timing where clocks that follow UTC say the rate, and the start to half a minute or so.

The rate being known, every start can be weighed with one set of gains for all windows, which finds messages that no
window shows by itself. The best start's surroundings are then weighed at nearby rates as well.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.detectors.matched.candidates import Tones
from mtm_audit.detectors.matched.coherent import Question, coherent_evidence
from mtm_audit.detectors.matched.correlate import Heard
from mtm_audit.detectors.matched.evidence import log_sum_exp
from mtm_audit.detectors.matched.hypotheses import log_clock_prior
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.model.timing import OnsetRange, Timing
from mtm_audit.model.track import Floats

_CHUNK = 256
# Beside a few thousand starts one that stands out so far is the right one.
_SURE_NATS = 10.0
# Starts are weighed every half cell, since a message of many symbols is lost between whole ones: of its highest tone a
# cell is a fifth of a period.
_HALF_CELL = 0.5
# Rates that move the recording's ends by half a cell against its middle, and starts in quarter cells.
_RATE_STEPS = np.arange(-6, 7)
_QUARTER_CELLS = np.arange(-2, 3) / 4.0


@dataclass(frozen=True)
class Found:
    """The most probable timing of one codebook, and its log evidence against a recording without its message."""

    timing: Timing
    evidence: float


@dataclass(frozen=True)
class Place:
    """A motion, how many cells before it a window may begin, and how long windows are."""

    motion: Motion
    lead: int
    ticks: int
    nominal_hz: float


def starts_by_clock(
    by_plant: Sequence[Heard],
    place: Place,
    tones: Sequence[Sequence[Tones]],
    bounds: OnsetRange,
    progress: Callable[[float], None] | None = None,
) -> list[Found]:
    """For each codebook the best timing with the first window's start within bounds.

    `by_plant` is what was heard at the nominal rate by each of some plants, the usual one first: where that leaves no
    doubt, starts are not weighed by the others, which can only lower the evidence. `tones` of the windows of each
    codebook, as many for all.
    """
    step_s = place.motion.step_s
    first = np.floor((bounds.low_s - place.motion.start_s) / step_s)
    count = int(np.ceil((bounds.high_s - bounds.low_s) / step_s / _HALF_CELL)) + 3
    onsets_s = place.motion.start_s + (first + np.arange(count) * _HALF_CELL) * step_s
    evidences = _by_chunks(by_plant[0], place, tones, onsets_s, progress)
    doubtful = [number for number, evidence in enumerate(evidences) if evidence.max() < _SURE_NATS]
    for heard in by_plant[1:] if doubtful else ():
        more = _by_chunks(heard, place, [tones[number] for number in doubtful], onsets_s)
        for number, evidence in zip(doubtful, more, strict=True):
            evidences[number] = np.logaddexp(evidences[number], evidence)
    starts_s = [float(onsets_s[np.argmax(evidence)]) for evidence in evidences]
    found: dict[float, list[Found]] = {}
    for start_s in set(starts_s):
        # Alternatives are the same for all codebooks, and few share a best start: their answers are cheap.
        onsets, rates_hz = _around(place, start_s)
        asked = [own for own, best_s in zip(tones, starts_s, strict=True) if best_s == start_s]
        prior = log_clock_prior(rates_hz, place.nominal_hz) - np.log(len(by_plant))
        near = zip(*(_weigh(heard, place, asked, onsets, rates_hz) for heard in by_plant), strict=True)
        found[start_s] = [_best(log_sum_exp(np.stack(own), axis=0) + prior, onsets, rates_hz) for own in near]
    return [found[start_s].pop(0) for start_s in starts_s]


def _by_chunks(
    heard: Heard,
    place: Place,
    tones: Sequence[Sequence[Tones]],
    onsets_s: Floats,
    progress: Callable[[float], None] | None = None,
) -> list[Floats]:
    """Evidence (starts,) for each codebook at the nominal rate, not too many starts at once."""
    chunks = np.array_split(onsets_s, -(-len(onsets_s) // _CHUNK))
    weighed = []
    for done, chunk in enumerate(chunks):
        if progress is not None:
            progress(done / len(chunks))
        weighed.append(_weigh(heard, place, tones, chunk, place.nominal_hz))
    return [np.concatenate(parts) for parts in zip(*weighed, strict=True)]


def _weigh(
    heard: Heard, place: Place, tones: Sequence[Sequence[Tones]], onsets_s: Floats, rates_hz: Floats | float
) -> list[Floats]:
    """Evidence (hypotheses,) of timings for each codebook."""
    lengths_s = place.ticks / np.broadcast_to(rates_hz, onsets_s.shape)
    begins_s = onsets_s[:, None] + np.arange(len(tones[0])) * lengths_s[:, None]
    lags = (begins_s - place.motion.start_s) / place.motion.step_s + place.lead
    inside = (lags >= 0) & (lags <= len(place.motion.seen) + place.lead - 1)
    return coherent_evidence(heard, [Question(numbered, lags, inside) for numbered in tones], place.motion.step_s)


def _around(place: Place, start_s: float) -> tuple[Floats, Floats]:
    """Onsets and rates near a start, turned about the window in the recording's middle."""
    motion, length_s = place.motion, place.ticks / place.nominal_hz
    lasts_s = len(motion.seen) * motion.step_s
    rates_hz = place.nominal_hz * (1.0 + _RATE_STEPS * motion.step_s / lasts_s)
    middle = np.rint((motion.start_s + lasts_s / 2.0 - start_s) / length_s)
    onsets_s = start_s + middle * (length_s - place.ticks / rates_hz)
    return (onsets_s[:, None] + _QUARTER_CELLS * motion.step_s).ravel(), np.repeat(rates_hz, len(_QUARTER_CELLS))


def _best(evidence: Floats, onsets_s: Floats, rates_hz: Floats) -> Found:
    place = int(np.argmax(evidence))
    return Found(Timing(float(onsets_s[place]), float(rates_hz[place])), float(evidence[place]))
