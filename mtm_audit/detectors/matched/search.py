"""Timing by matched filtering: which clock rate and which window phase explain the motion best.

First each window's evidence, gains unknown, is folded over the recording at every rate and onset; then the best
hypotheses are weighed again with one set of gains for all windows, and the winner's surroundings in half cells. Where
the onset is known, all rates are weighed so at once.
Signs, rotations and mirrors of the camera do not matter. All of it is done for each codebook alike.
"""

from collections.abc import Callable, Sequence

import numpy as np

from mtm_audit.detectors.matched.byclock import Found, Place, starts_by_clock
from mtm_audit.detectors.matched.candidates import WHOLE, LazyTones, Tones
from mtm_audit.detectors.matched.coherent import Question, coherent_evidence
from mtm_audit.detectors.matched.correlate import Prepared, hear
from mtm_audit.detectors.matched.folding import Candidate, Folding
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.places import Places
from mtm_audit.detectors.matched.rates import USUAL_RATES, Sweep, Told, usual_first
from mtm_audit.model.timing import Onset, OnsetRange, Timing
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel, Scheme

SEARCHED_RATES = 0.2
_PHASE_ERROR_RAD = 0.6
_WEIGHED = 64
_HALF_CELLS = np.arange(-3, 4) / 2.0
# How much later than the typical plant a robot may follow, where its onset is known.
_LATER_S = np.array([0.0, 0.1, 0.2])
# Of alphabets above this, which cost most to look for, one in so many unusual rates and cells is looked at first.
_SKIM_ABOVE = 16_384
_SKIMMED = 2


_Report = Callable[[float], None]


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
        near = np.abs(rates_hz / scheme.rate_hz - 1.0) <= USUAL_RATES
        # A spacing is needed however far apart the rates are.
        rates_hz = rates_hz[near] if near.sum() > 1 else rates_hz[len(rates_hz) // 2 - 1 : len(rates_hz) // 2 + 2]
    lead = lead_cells(scheme, channel, motion, onset)
    windows = waveform_sets(scheme, channel, motion, onset)
    tones = [LazyTones(book, one, windows) for book, one in played]
    if isinstance(onset, OnsetRange):
        by_plant = [hear(prepared, codebook, channel, scheme.rate_hz, lead, slower=slower) for slower in (False, True)]
        return starts_by_clock(by_plant, Place(motion, lead, ticks, scheme.rate_hz), tones, onset, progress)
    places = Places(
        prepared=prepared,
        codebook=codebook,
        channel=channel,
        rates_hz=rates_hz,
        lead=lead,
        windows=windows,
        onset=onset,
    )

    def report(fraction: float) -> None:
        if progress is not None:
            progress(fraction)

    if isinstance(onset, int | float):
        return _delays_and_rates(places, tones, report)
    return _onsets_and_rates(places, tones, report)


def _delays_and_rates(places: Places, tones: Sequence[Sequence[Tones]], report: _Report) -> list[Found]:
    """Only the rate is open, and how late the robot follows: all can be weighed with one set of gains."""
    best = usual_first(
        places.rates,
        lambda sweep: _best_delays(places, sweep, tones, report),
        lambda each: Told(each[0].evidence, each[1], each[0].timing.rate_hz),
        nominal_first=_is_large(tones),
    )
    return [_closer(places, coarse, each, tones[number]) for number, (each, coarse) in enumerate(best)]


def _best_delays(
    places: Places, sweep: Sweep, tones: Sequence[Sequence[Tones]], report: _Report
) -> list[tuple[Found, int]]:
    """The best timing of each channel at some coarse rates, and at which of them."""
    best: list[tuple[Found, int]] = []
    for done, coarse in enumerate(sweep.numbers):
        report(done / len(sweep.numbers))
        found = _surroundings(places, coarse, tones, [0] * len(tones), _LATER_S / places.motion.step_s)
        here = [(each, coarse) for each in found]
        best = here if not best else [max(pair, key=_found_evidence) for pair in zip(best, here, strict=True)]
    return best


def _is_large(tones: Sequence[Sequence[Tones]]) -> bool:
    return len(tones[0][0]) > WHOLE


def _found_evidence(found: tuple[Found, int]) -> float:
    return found[0].evidence


def _closer(places: Places, coarse: int, found: Found, tones: Sequence[Tones]) -> Found:
    """The best timing in half cells around one that was found with a known onset."""
    motion = places.motion
    later = (found.timing.onset_s - motion.start_s) / motion.step_s + places.lead - places.grid(coarse).starts[0]
    return _surroundings(places, coarse, [tones], [0], later + _HALF_CELLS)[0]


def _onsets_and_rates(places: Places, tones: Sequence[Sequence[Tones]], report: _Report) -> list[Found]:
    folding = Folding(places, tones)
    best = usual_first(
        places.rates,
        lambda sweep: _best_of_rates(folding, sweep, report),
        lambda each: Told(each[0], each[1].coarse, each[1].rate_hz),
        nominal_first=_is_large(tones),
        every=_SKIMMED if len(tones[0][0]) > _SKIM_ABOVE else 1,
    )
    found_at: dict[int, Found] = {}
    winning = sorted({(winner.coarse, winner.skimmed) for _, winner in best})
    for done, (coarse, skimmed) in enumerate(winning):
        report(0.5 + 0.5 * done / len(winning))
        numbers = [n for n, (_, winner) in enumerate(best) if (winner.coarse, winner.skimmed) == (coarse, skimmed)]
        if skimmed:
            found_at.update({number: _turned(places, best[number][1], tones[number]) for number in numbers})
            continue
        starts = [best[number][1].hypothesis.start for number in numbers]
        near = _surroundings(places, coarse, [tones[number] for number in numbers], starts, _HALF_CELLS)
        found_at.update(zip(numbers, near, strict=True))
    return [found_at[number] for number in range(len(best))]


def _turned(places: Places, near: Candidate, tones: Sequence[Tones]) -> Found:
    """The best timing around one whose rate was skimmed: rates of the coarse ones next to it as well, turned about the
    window in the recording's middle, and onsets in half cells.
    """
    motion, ticks = places.motion, places.codebook.scheme.window_ticks(places.channel)
    cells = len(motion.seen)
    best: list[Found] = []
    for coarse in range(max(near.coarse - 1, 0), min(near.coarse + 2, places.rates.count)):
        grid = places.grid(coarse)
        lengths = ticks / grid.rates_hz / motion.step_s
        length = ticks / near.rate_hz / motion.step_s
        start = float(near.hypothesis.start)
        middle = np.rint((places.lead + cells / 2.0 - start) / length)
        starts = ((start + middle * (length - lengths))[:, None] + _HALF_CELLS).ravel()
        numbers = np.arange(grid.lags.shape[2])
        lags = starts[:, None] + numbers * np.repeat(lengths, len(_HALF_CELLS))[:, None]
        inside = (lags >= 0) & (lags <= cells + places.lead - 1)
        (answer,) = coherent_evidence(places.heard(coarse), [Question(tones, lags, inside)], motion.step_s)
        evidence = answer + np.repeat(grid.prior, len(_HALF_CELLS))
        top = int(np.argmax(evidence))
        onset_s = motion.start_s + (float(starts[top]) - places.lead) * motion.step_s
        rate_hz = float(grid.rates_hz[top // len(_HALF_CELLS)])
        best.append(Found(Timing(onset_s, rate_hz), float(evidence[top])))
    return max(best, key=lambda found: found.evidence)


def _best_of_rates(folding: Folding, sweep: Sweep, report: _Report) -> list[tuple[float, Candidate]]:
    """The best hypothesis of each channel in one round of the search, with its coherent evidence."""
    candidates: list[list[Candidate]] = [[] for _ in folding.tones]
    for done, coarse in enumerate(sweep.numbers):
        report(0.5 * done / len(sweep.numbers))
        for own, more in zip(candidates, folding.best(coarse, sweep.starts, sweep.every), strict=True):
            own += more
    chosen = [sorted(found, key=lambda item: -item.hypothesis.evidence)[: _WEIGHED + sweep.starts]
              for found in candidates]  # fmt: skip
    best = [(-np.inf, found[0]) for found in chosen]
    for coarse in sorted({item.coarse for found in chosen for item in found}):
        here = [[item for item in found if item.coarse == coarse] for found in chosen]
        numbers = [number for number, items in enumerate(here) if items]
        weighed = _weigh(folding, coarse, [folding.tones[n] for n in numbers], [here[n] for n in numbers])
        for number, winner in zip(numbers, weighed, strict=True):
            best[number] = max(best[number], winner, key=_evidence)
    return best


def _evidence(weighed: tuple[float, Candidate]) -> float:
    return weighed[0]


def _weigh(
    folding: Folding, coarse: int, tones: Sequence[Sequence[Tones]], candidates: Sequence[Sequence[Candidate]]
) -> list[tuple[float, Candidate]]:
    """For each codebook the best of its hypotheses of one grid, with its coherent evidence."""
    heard, grid = folding.heard(coarse), folding.places.grid(coarse)
    rates = [np.array([item.hypothesis.rate for item in items]) for items in candidates]
    starts = [np.array([item.hypothesis.start for item in items]) for items in candidates]
    questions = [
        Question(numbered, grid.lags[rate, start], grid.inside[rate, start])
        for numbered, rate, start in zip(tones, rates, starts, strict=True)
    ]
    result = []
    answers = coherent_evidence(heard, questions, folding.places.motion.step_s)
    for evidence, rate, items in zip(answers, rates, candidates, strict=True):
        weighed = evidence + grid.prior[rate]
        winner = int(np.argmax(weighed))
        result.append((float(weighed[winner]), items[winner]))
    return result


def _surroundings(
    places: Places, coarse: int, tones: Sequence[Sequence[Tones]], starts: Sequence[int], shifts: Floats
) -> list[Found]:
    """For each codebook the best timing around its start: all fine rates of the grid, onsets `shifts` cells later."""
    heard, grid, motion = places.heard(coarse), places.grid(coarse), places.motion
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
        onset_s = motion.start_s + (float(grid.starts[start] + shifts[shift]) - places.lead) * motion.step_s
        result.append(Found(Timing(onset_s, float(grid.rates_hz[rate])), float(evidence[rate, shift])))
    return result
