"""Timing by matched filtering: which clock rate and which window phase explain the motion best.

First each window's evidence, gains unknown, is folded over the recording at every rate and onset; then the best
hypotheses are weighed again with one set of gains for all windows, and the winner's surroundings in half cells. Where
the onset is known, all rates are weighed so at once.
Signs, rotations and mirrors of the camera do not matter. All of it is done for each codebook alike.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from mtm_audit.detectors.matched.byclock import Found, Place, starts_by_clock
from mtm_audit.detectors.matched.candidates import WHOLE, LazyTones, Tones
from mtm_audit.detectors.matched.coherent import Question, coherent_evidence
from mtm_audit.detectors.matched.correlate import Heard, Prepared, evidence_by_lag, hear
from mtm_audit.detectors.matched.hypotheses import Grid, Hypothesis, fold, make_grid
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.model.timing import Onset, OnsetRange, Timing
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel, Scheme

SEARCHED_RATES = 0.2
_PHASE_ERROR_RAD = 0.6
_PEAKS_PER_RATE = 8
_WEIGHED = 64
# Window by window a weak message is lost among starts; at usual rates so many are weighed whatever they look like.
_USUAL_STARTS = 128
_USUAL_RATES = 0.03
_PLAIN_NATS = 20.0
# Of the distance between coarse rates; half of it is where the next one's begin.
_NEAR_NOMINAL = 0.25
_HALF_CELLS = np.arange(-3, 4) / 2.0
# How much later than the typical plant a robot may follow, where its onset is known.
_LATER_S = np.array([0.0, 0.1, 0.2])


@dataclass(frozen=True)
class _Candidate:
    """A hypothesis and the coarse rate in whose grid it stands."""

    coarse: int
    hypothesis: Hypothesis
    rate_hz: float


# What all codebooks share at one coarse rate, by its number.
_Place = Callable[[int], tuple[Heard, Grid]]
_Report = Callable[[float], None]
_Best = TypeVar("_Best")


def candidate_rates(scheme: Scheme, channel: Channel, onset: Onset) -> Floats:
    """Rates that are searched, as far apart as the highest tone's phase at a window's ends allows; nominal among them.

    They span +-20 %; where clocks that follow UTC bound the onset the rate is the nominal one.
    """
    if isinstance(onset, OnsetRange):
        return np.array([scheme.rate_hz])
    window_s = scheme.window_ticks(channel) / scheme.rate_hz
    step = 2.0 * _PHASE_ERROR_RAD / (np.pi * scheme.band_hz[1] * window_s)
    count = int(np.ceil(SEARCHED_RATES / step))
    rates: Floats = scheme.rate_hz * (1.0 + np.arange(-count, count + 1) * (SEARCHED_RATES / count))
    return rates


def lead_cells(scheme: Scheme, channel: Channel, motion: Motion, onset: Onset) -> int:
    """Cells before the recording in which a window may begin that it sees the end of."""
    return int(np.ceil(scheme.window_ticks(channel) / candidate_rates(scheme, channel, onset)[0] / motion.step_s))


def waveform_sets(scheme: Scheme, channel: Channel, motion: Motion, onset: Onset) -> int:
    """How many windows with waveforms of their own begin before the recording ends: 1 under the fixed schedule."""
    if scheme.schedule == "fixed":
        return 1
    origin_s = onset.low_s if isinstance(onset, OnsetRange) else motion.start_s if onset is None else onset
    end_s = motion.start_s + len(motion.seen) * motion.step_s
    fastest_hz = float(candidate_rates(scheme, channel, onset)[-1])
    return int(np.ceil((end_s - min(origin_s, motion.start_s)) * fastest_hz / scheme.window_ticks(channel)))


def search_timings(
    played: Sequence[tuple[Codebook, Channel]],
    prepared: Prepared,
    onset: Onset,
    progress: Callable[[float], None] | None = None,
    *,
    usual_rates: bool = False,
) -> list[Found]:
    """The best timing of each channel that may be `played`: rates, and onsets as far as they are not known.

    The channels' codebooks share one scheme and their windows one length. Rates lie within +-20 %, and where clocks
    bound the onset near the nominal one. Under the fixed schedule the onset found is that of the first window in step
    with the message. With `usual_rates` clocks that are off by more than 3 % are left out.
    """
    (codebook, channel), motion = played[0], prepared.motion
    scheme = codebook.scheme
    ticks = scheme.window_ticks(channel)
    rates_hz = candidate_rates(scheme, channel, onset)
    if usual_rates and len(rates_hz) > 1:
        near = np.abs(rates_hz / scheme.rate_hz - 1.0) <= _USUAL_RATES
        # A spacing is needed however far apart the rates are.
        rates_hz = rates_hz[near] if near.sum() > 1 else rates_hz[len(rates_hz) // 2 - 1 : len(rates_hz) // 2 + 2]
    lead = lead_cells(scheme, channel, motion, onset)
    windows = waveform_sets(scheme, channel, motion, onset)
    tones = [LazyTones(book, one, windows) for book, one in played]
    if isinstance(onset, OnsetRange):
        by_plant = [hear(prepared, codebook, channel, scheme.rate_hz, lead, slower=slower) for slower in (False, True)]
        return starts_by_clock(by_plant, Place(motion, lead, ticks, scheme.rate_hz), tones, onset, progress)
    spacing = float(rates_hz[1] - rates_hz[0]) / scheme.rate_hz
    rates = _Rates(len(rates_hz), spacing, scheme.rate_hz)

    def place(coarse: int) -> tuple[Heard, Grid]:
        rate_hz = float(rates_hz[coarse])
        grid = make_grid(motion, scheme.rate_hz, rate_hz, spacing, ticks, lead, windows, onset)
        return hear(prepared, codebook, channel, rate_hz, lead), grid

    def report(fraction: float) -> None:
        if progress is not None:
            progress(fraction)

    if isinstance(onset, int | float):
        return _delays_and_rates(place, rates, tones, motion, lead, report)
    return _onsets_and_rates(place, rates, tones, motion, lead, report)


def _delays_and_rates(
    place: _Place,
    rates: "_Rates",
    tones: Sequence[Sequence[Tones]],
    motion: Motion,
    lead: int,
    report: _Report,
) -> list[Found]:
    """Only the rate is open, and how late the robot follows: all can be weighed with one set of gains."""
    best = _usual_first(
        rates,
        lambda some, _: _best_delays(place, some, tones, motion, lead, report),
        lambda each: _Told(each[0].evidence, each[1], each[0].timing.rate_hz),
        _is_large(tones),
    )
    return [_closer(place, coarse, each, tones[number], motion, lead) for number, (each, coarse) in enumerate(best)]


def _best_delays(
    place: _Place,
    rates: Sequence[int],
    tones: Sequence[Sequence[Tones]],
    motion: Motion,
    lead: int,
    report: _Report,
) -> list[tuple[Found, int]]:
    """The best timing of each channel at some coarse rates, and at which of them."""
    best: list[tuple[Found, int]] = []
    for done, coarse in enumerate(rates):
        report(done / len(rates))
        heard, grid = place(coarse)
        found = _surroundings(heard, grid, tones, [0] * len(tones), motion, lead, _LATER_S / motion.step_s)
        here = [(each, coarse) for each in found]
        best = here if not best else [max(pair, key=_found_evidence) for pair in zip(best, here, strict=True)]
    return best


@dataclass(frozen=True)
class _Rates:
    """The coarse rates: `count` of them, the nominal one in the middle, relative `spacing` apart."""

    count: int
    spacing: float
    nominal_hz: float

    @property
    def middle(self) -> int:
        """The number of the nominal rate."""
        return self.count // 2

    def by_use(self) -> tuple[list[int], list[int]]:
        """The numbers of the rates that usual clocks have, and of the others."""
        usual = [at for at in range(self.count) if abs(at - self.middle) * self.spacing <= _USUAL_RATES]
        return usual, [at for at in range(self.count) if at not in usual]


@dataclass(frozen=True)
class _Told:
    """A result's evidence, its coarse rate's number and its rate."""

    evidence: float
    coarse: int
    rate_hz: float


def _is_large(tones: Sequence[Sequence[Tones]]) -> bool:
    return len(tones[0][0]) > WHOLE


def _usual_first(
    rates: _Rates,
    best_at: Callable[[Sequence[int], int], list[_Best]],
    told: Callable[[_Best], _Told],
    large: bool,
) -> list[_Best]:
    """The best of each channel at the coarse rates of usual clocks, and where one does not stand out there, at all.

    A `large` alphabet, which costs most to look for, is looked for at the nominal rate before that, where it peaks.
    """
    if large:
        best = best_at([rates.middle], 0)
        if _plain_at_nominal([told(each) for each in best], rates):
            return best
    usual, others = rates.by_use()
    best = best_at(usual, _USUAL_STARTS)
    if others and not _plain([told(each) for each in best], rates):
        best = [
            max(pair, key=lambda each: told(each).evidence)
            for pair in zip(best, best_at(others, _USUAL_STARTS), strict=True)
        ]
    return best


def _plain_at_nominal(best: Sequence[_Told], rates: _Rates) -> bool:
    """Whether every message stands out near the nominal rate, clear of what the next coarse rate would show better."""
    far = _NEAR_NOMINAL * rates.spacing
    return all(one.evidence > _PLAIN_NATS and abs(one.rate_hz / rates.nominal_hz - 1.0) <= far for one in best)


def _plain(best: Sequence[_Told], rates: _Rates) -> bool:
    """Whether every message stands out well inside the usual rates: clocks are seldom far off, and then others cannot
    do better.
    """
    return all(
        one.evidence > _PLAIN_NATS and abs(one.coarse - rates.middle) * rates.spacing <= 0.5 * _USUAL_RATES
        for one in best
    )


def _found_evidence(found: tuple[Found, int]) -> float:
    return found[0].evidence


def _closer(place: _Place, coarse: int, found: Found, tones: Sequence[Tones], motion: Motion, lead: int) -> Found:
    """The best timing in half cells around one that was found with a known onset."""
    heard, grid = place(coarse)
    later = (found.timing.onset_s - motion.start_s) / motion.step_s + lead - grid.starts[0]
    return _surroundings(heard, grid, [tones], [0], motion, lead, later + _HALF_CELLS)[0]


def _onsets_and_rates(
    place: _Place,
    rates: "_Rates",
    tones: Sequence[Sequence[Tones]],
    motion: Motion,
    lead: int,
    report: _Report,
) -> list[Found]:
    best = _usual_first(
        rates,
        lambda some, usual: _best_of_rates(place, some, usual, tones, motion, report),
        lambda each: _Told(each[0], each[1].coarse, each[1].rate_hz),
        _is_large(tones),
    )
    found_at: dict[int, Found] = {}
    winning = sorted({winner.coarse for _, winner in best})
    for done, coarse in enumerate(winning):
        report(0.5 + 0.5 * done / len(winning))
        heard, grid = place(coarse)
        numbers = [number for number, (_, winner) in enumerate(best) if winner.coarse == coarse]
        starts = [best[number][1].hypothesis.start for number in numbers]
        near = _surroundings(heard, grid, [tones[n] for n in numbers], starts, motion, lead, _HALF_CELLS)
        found_at.update(zip(numbers, near, strict=True))
    return [found_at[number] for number in range(len(best))]


def _best_of_rates(
    place: _Place, rates: Sequence[int], usual: int, tones: Sequence[Sequence[Tones]], motion: Motion, report: _Report
) -> list[tuple[float, _Candidate]]:
    """The best hypothesis of each channel at some coarse rates, with its coherent evidence.

    `usual` starts are weighed whatever they look like.
    """
    candidates: list[list[_Candidate]] = [[] for _ in tones]
    for done, coarse in enumerate(rates):
        report(0.5 * done / len(rates))
        heard, grid = place(coarse)
        for number, peaks in enumerate(fold(evidence_by_lag(tones, heard), grid, _PEAKS_PER_RATE, usual)):
            candidates[number] += [_Candidate(coarse, peak, float(grid.rates_hz[peak.rate])) for peak in peaks]
    chosen = [sorted(found, key=lambda item: -item.hypothesis.evidence)[: _WEIGHED + usual]
              for found in candidates]  # fmt: skip
    best = [(-np.inf, found[0]) for found in chosen]
    for coarse in sorted({item.coarse for found in chosen for item in found}):
        heard, grid = place(coarse)
        here = [[item for item in found if item.coarse == coarse] for found in chosen]
        numbers = [number for number, items in enumerate(here) if items]
        weighed = _weigh(heard, grid, [tones[number] for number in numbers], [here[n] for n in numbers], motion.step_s)
        for number, winner in zip(numbers, weighed, strict=True):
            best[number] = max(best[number], winner, key=_evidence)
    return best


def _evidence(weighed: tuple[float, _Candidate]) -> float:
    return weighed[0]


def _weigh(
    heard: Heard,
    grid: Grid,
    tones: Sequence[Sequence[Tones]],
    candidates: Sequence[Sequence[_Candidate]],
    step_s: float,
) -> list[tuple[float, _Candidate]]:
    """For each codebook the best of its hypotheses of one grid, with its coherent evidence."""
    rates = [np.array([item.hypothesis.rate for item in items]) for items in candidates]
    starts = [np.array([item.hypothesis.start for item in items]) for items in candidates]
    questions = [
        Question(numbered, grid.lags[rate, start], grid.inside[rate, start])
        for numbered, rate, start in zip(tones, rates, starts, strict=True)
    ]
    result = []
    for evidence, rate, items in zip(coherent_evidence(heard, questions, step_s), rates, candidates, strict=True):
        weighed = evidence + grid.prior[rate]
        winner = int(np.argmax(weighed))
        result.append((float(weighed[winner]), items[winner]))
    return result


def _surroundings(
    heard: Heard,
    grid: Grid,
    tones: Sequence[Sequence[Tones]],
    starts: Sequence[int],
    motion: Motion,
    lead: int,
    shifts: Floats,
) -> list[Found]:
    """For each codebook the best timing around its start: all fine rates of the grid, onsets `shifts` cells later."""
    around = {}
    for start in set(starts):
        lags = grid.lags[:, start][:, None, :] + shifts[None, :, None]
        inside = np.broadcast_to(grid.inside[:, start][:, None, :], lags.shape)
        around[start] = (lags.reshape(-1, lags.shape[2]), inside.reshape(-1, lags.shape[2]))
    questions = [Question(numbered, *around[start]) for numbered, start in zip(tones, starts, strict=True)]
    result = []
    for answer, start in zip(coherent_evidence(heard, questions, motion.step_s), starts, strict=True):
        evidence = answer.reshape(-1, len(shifts)) + grid.prior[:, None]
        rate, shift = np.unravel_index(np.argmax(evidence), evidence.shape)
        onset_s = motion.start_s + (float(grid.starts[start] + shifts[shift]) - lead) * motion.step_s
        result.append(Found(Timing(onset_s, float(grid.rates_hz[rate])), float(evidence[rate, shift])))
    return result
