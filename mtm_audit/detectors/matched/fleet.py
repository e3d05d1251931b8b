"""One timing for the robots of one recording, whose camera, clock rate and start are mostly the same.

A robot whose motion leaves its own timing open is read by the timing of its fleet: the best timings that robots found
by themselves are weighed by all of them, and the one that all together like best is the fleet's. Every decoy's robots
do the same among themselves, so that the key stays one of them when there is no message.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mtm_audit.detectors.matched.byclock import Found
from mtm_audit.detectors.matched.candidates import LazyTones, Tones
from mtm_audit.detectors.matched.coherent import Question, coherent_evidence
from mtm_audit.detectors.matched.correlate import Prepared, hear
from mtm_audit.detectors.matched.hypotheses import log_rate_prior
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.search import candidate_rates, lead_cells, waveform_sets
from mtm_audit.detectors.matched.windows import LEAST_PART
from mtm_audit.model.timing import Onset, Timing
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel, Scheme

# So many timings are offered at the most, so that the cost grows with the robots and not with their square.
_OFFERS = 4
_RATE_STEPS = np.arange(-4, 5)
_HALF_CELLS = np.arange(-2, 3) / 2.0
# A timing that a robot found by itself is the best of about so many; one that its fleet shows is the only one.
_TIMINGS = 500.0


@dataclass(frozen=True)
class _Near:
    """Timings near one that is offered: `rates_hz` and `onsets_s` (timings,); `coarse_hz` is where to correlate."""

    rates_hz: Floats
    onsets_s: Floats
    coarse_hz: float


@dataclass(frozen=True)
class Member:
    """One robot of a fleet: its channel, its motion, and what it `searched` and found by itself, for each codebook."""

    channel: Channel
    prepared: Prepared
    searched: Sequence[Found]


def share_timings(codebooks: Sequence[Codebook], fleet: Sequence[Member], onset: Onset) -> list[list[Found]]:
    """For each robot, for each codebook the timing once the robots know of each other's; the evidence is the largest
    that the robot met. All channels have windows of one length.
    """
    offered = []
    for number, codebook in enumerate(codebooks):
        strongest = sorted((member.searched[number] for member in fleet), key=lambda found: -found.evidence)[:_OFFERS]
        offered.append([_near(codebook, fleet, found.timing, onset) for found in strongest])
    weighed = [_weigh(codebooks, member, offered, onset) for member in fleet]
    result: list[list[Found]] = [[] for _ in fleet]
    for number, codebook in enumerate(codebooks):
        shared, best = _fleet_timing(codebook, offered[number], [evidence[number] for evidence in weighed])
        settled = _settled([member.searched[number] for member in fleet], shared)
        for row, (member, found) in enumerate(zip(fleet, settled, strict=True)):
            timing = found.timing
            if onset is None and codebook.scheme.schedule == "fixed":
                timing = _counted_from_first_message(timing, codebook.scheme, member)
            result[row].append(Found(timing, max(member.searched[number].evidence, best[row])))
    return result


def _counted_from_first_message(timing: Timing, scheme: Scheme, member: Member) -> Timing:
    """The same timing with an onset whole messages away, so that the first message is one that the robot shows."""
    length_s = scheme.window_ticks(member.channel) / timing.rate_hz
    first = np.ceil((member.prepared.motion.start_s - timing.onset_s) / length_s - (1.0 - LEAST_PART))
    messages = np.floor(first / member.channel.symbols)
    return replace(timing, onset_s=float(timing.onset_s + messages * member.channel.symbols * length_s))


def _near(codebook: Codebook, fleet: Sequence[Member], timing: Timing, onset: Onset) -> _Near:
    """Rates that move the ends of the recording by half a cell against its middle, and onsets in half cells."""
    scheme, channel = codebook.scheme, fleet[0].channel
    ticks = scheme.window_ticks(channel)
    motions = [member.prepared.motion for member in fleet]
    step_s = min(motion.step_s for motion in motions)
    start_s = min(motion.start_s for motion in motions)
    end_s = max(motion.start_s + len(motion.seen) * motion.step_s for motion in motions)
    rates_hz = timing.rate_hz * (1.0 + _RATE_STEPS * step_s / (end_s - start_s))
    if not isinstance(onset, int | float):
        middle = np.rint(((start_s + end_s) / 2.0 - timing.onset_s) * timing.rate_hz / ticks)
        middle_s = timing.onset_s + middle * ticks / timing.rate_hz
        onsets_s = (middle_s - middle * ticks / rates_hz)[:, None] + _HALF_CELLS * step_s
    else:
        onsets_s = np.full((len(rates_hz), 1), onset)
    coarse = candidate_rates(scheme, channel, onset)
    coarse_hz = float(coarse[np.argmin(np.abs(coarse - timing.rate_hz))])
    return _Near(np.repeat(rates_hz, onsets_s.shape[1]), onsets_s.ravel(), coarse_hz)


def _weigh(
    codebooks: Sequence[Codebook], member: Member, offered: Sequence[Sequence[_Near]], onset: Onset
) -> list[Floats]:
    """One robot's evidence without prior of what each codebook's fleet offers, (offers, timings) for each codebook."""
    scheme, channel, motion = codebooks[0].scheme, member.channel, member.prepared.motion
    lead, windows = lead_cells(scheme, channel, motion, onset), waveform_sets(scheme, channel, motion, onset)
    ticks, from_onset = scheme.window_ticks(channel), isinstance(onset, int | float)
    tones = [LazyTones(codebook, channel, windows) for codebook in codebooks]
    result: list[Floats] = [np.empty((len(nears), len(nears[0].rates_hz))) for nears in offered]
    for coarse_hz in sorted({near.coarse_hz for nears in offered for near in nears}):
        heard = hear(member.prepared, codebooks[0], channel, coarse_hz, lead)
        places = [
            (number, row)
            for number, nears in enumerate(offered)
            for row, near in enumerate(nears)
            if near.coarse_hz == coarse_hz
        ]
        questions = [
            _question(motion, tones[number], offered[number][row], ticks, lead, from_onset=from_onset)
            for number, row in places
        ]
        for (number, row), evidence in zip(places, coherent_evidence(heard, questions, motion.step_s), strict=True):
            result[number][row] = evidence
    return result


def _question(
    motion: Motion, tones: Sequence[Tones], near: _Near, ticks: int, lead: int, *, from_onset: bool
) -> Question:
    """The timings' evidence; windows before the onset count where the message may have begun earlier."""
    lengths_s = ticks / near.rates_hz
    available = len(motion.seen) + lead
    before = (motion.start_s - lead * motion.step_s - near.onsets_s) / lengths_s
    first = 0 if from_onset else int(np.floor(before.min()))
    last = int(np.ceil((before + available * motion.step_s / lengths_s).max()))
    numbers = np.arange(len(tones)) if len(tones) > 1 else np.arange(first, max(first, last) + 1)
    lags = (near.onsets_s[:, None] + numbers * lengths_s[:, None] - motion.start_s) / motion.step_s + lead
    return Question(tones, lags, (lags >= 0) & (lags <= available - 1))


def _fleet_timing(
    codebook: Codebook, offered: Sequence[_Near], weighed: Sequence[Floats]
) -> tuple[list[Found], list[float]]:
    """Each robot's evidence at the timing that all together like best, and the best that it met at any offered."""
    prior = np.stack([log_rate_prior(near.rates_hz, codebook.scheme.rate_hz) for near in offered])
    offer, place = divmod(int(np.argmax(np.sum(weighed, axis=0) + prior)), prior.shape[1])
    timing = Timing(float(offered[offer].onsets_s[place]), float(offered[offer].rates_hz[place]))
    shared = [Found(timing, float((evidence + prior)[offer, place])) for evidence in weighed]
    return shared, [float((evidence + prior).max()) for evidence in weighed]


def _settled(own: Sequence[Found], shared: Sequence[Found]) -> list[Found]:
    """The more probable of each robot's own timing and the fleet's, as far as the other robots show that it is one.

    Even odds before that the robots share a timing or that each has one of its own.
    """
    apart = np.array([found.evidence for found in own]) - np.log(_TIMINGS)
    together = np.array([found.evidence for found in shared])
    others_apart, others_together = apart.sum() - apart, together.sum() - together - np.log(_TIMINGS)
    shown = np.exp(-np.logaddexp(0.0, others_apart - others_together))
    preferred = together + np.log1p(_TIMINGS * shown) > apart + np.log(_TIMINGS)
    return [two if prefer else one for one, two, prefer in zip(own, shared, preferred, strict=True)]
