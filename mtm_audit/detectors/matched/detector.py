"""The matched detector behind the common interface."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import softmax

from mtm_audit.detectors.base import ChannelReading, Observation, Reading, StrengthLaw
from mtm_audit.detectors.matched.byclock import Found
from mtm_audit.detectors.matched.correlate import Prepared, prepare
from mtm_audit.detectors.matched.estimate import Estimate, estimate, first_evidence, fit_recording_noise
from mtm_audit.detectors.matched.fleet import Member, share_timings
from mtm_audit.detectors.matched.hypotheses import log_rate_prior
from mtm_audit.detectors.matched.kinds import elsewhere, reading_order
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.noise import NoiseModel, principal_axes
from mtm_audit.detectors.matched.profile import PlantProfile
from mtm_audit.detectors.matched.refine import refined_timing
from mtm_audit.detectors.matched.search import SEARCHED_RATES, search_timings
from mtm_audit.detectors.matched.windows import LEAST_PART, Window, make_windows, shown_numbers
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.timing import Onset, OnsetRange, Timing
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Channel

# How much likelier a clock is that keeps its rate than the one rate, of all that a search tries, which fits best.
_NOMINAL_NATS = 2.0


class MatchedDetector:
    """Whitened matched filtering with a plant shared by all windows; scores are log-likelihood ratios in nats.

    `profile` is what is known of the robots' plant beforehand, None when nothing is.
    """

    name = "matched"
    strength_law: StrengthLaw = "log evidence"

    def __init__(self, profile: PlantProfile | None = None) -> None:
        self._profile = profile

    def read(
        self,
        codebook: Codebook,
        decoys: Sequence[Codebook],
        observations: Sequence[Observation],
        onset: Onset,
        progress: Callable[[float], None] | None = None,
    ) -> list[ChannelReading | MtmError]:
        """Search each observation's timing under every codebook; then read all observations together under the key.

        The strength is the evidence that the search found, so decoys need no more than the search.
        """
        glimpses = [observation.glimpse for observation in observations]
        motions, refusals = _motions(glimpses, codebook)
        channels = {number: observations[number].channel for number in motions}
        for number in list(motions):
            # A search for windows far longer than the recording takes a memory of their length.
            if _holds_no_part(codebook, channels[number], motions[number]):
                refusals[number] = _less_than_a_part(codebook, channels[number], codebook.scheme.rate_hz)
                del motions[number]
        prepared = _prepared(motions, glimpses)
        alone = _searched([codebook, *decoys], channels, prepared, onset, progress)
        searched = _shared([codebook, *decoys], channels, prepared, alone, onset)
        for number in list(motions):
            refusal = _too_short(codebook, channels[number], prepared[number], searched[number][0].timing, onset)
            if refusal is not None:
                refusals[number] = refusal
                del motions[number]
        readings: dict[int, ChannelReading] = {}
        for numbers in reading_order(_kinds(motions, glimpses), channels, searched):
            # What is read again is not kept meanwhile.
            readings = {number: found for number, found in readings.items() if number not in numbers}
            others = {channels[number].name: found.reading for number, found in readings.items()}
            readings |= self._read_together(codebook, channels, prepared, numbers, searched, onset, others)
        for number, reading in readings.items():
            own = alone[number][0]
            readings[number] = replace(reading, alone=own.timing, alone_strength=own.evidence)
        return [readings[number] if number in readings else refusals[number] for number in range(len(observations))]

    def strengths(
        self,
        codebooks: Sequence[Codebook],
        channels: Sequence[Channel],
        glimpses: Sequence[Glimpse],
        onset: Onset,
        *,
        usual_rates: bool = False,
    ) -> Floats:
        """The log evidence that the search finds for each channel in each glimpse: (codebooks, channels, glimpses)."""
        result = np.full((len(codebooks), len(channels), len(glimpses)), np.nan)
        motions, _ = _motions(glimpses, codebooks[0])
        ticks = np.array([codebooks[0].scheme.window_ticks(channel) for channel in channels])
        for column, prepared in _prepared(motions, glimpses).items():
            for length in np.unique(ticks):
                rows = np.flatnonzero(ticks == length)
                if _holds_no_part(codebooks[0], channels[int(rows[0])], prepared.motion):
                    continue
                played = [(codebook, channels[int(row)]) for row in rows for codebook in codebooks]
                found = search_timings(played, prepared, onset, usual_rates=usual_rates)
                for place, item in enumerate(found):
                    row, number = divmod(place, len(codebooks))
                    channel = channels[int(rows[row])]
                    if _too_short(codebooks[0], channel, prepared, item.timing, onset) is None:
                        result[number, rows[row], column] = item.evidence
        return result

    def _read_together(
        self,
        codebook: Codebook,
        channels: dict[int, Channel],
        prepared: dict[int, Prepared],
        numbers: Sequence[int],
        searched: dict[int, list[Found]],
        onset: Onset,
        others: Mapping[str, Reading],
    ) -> dict[int, ChannelReading]:
        """Symbols of all observations that hold enough, with a plant that they may share.

        `others` by channel name is what motion of other kinds, which carries the same symbols, has shown.
        """
        moved = [prepared[number].motion for number in numbers]
        own = [channels[number] for number in numbers]
        noise = fit_recording_noise(moved, [motion.velocities for motion in moved])
        names = [channel.name for channel in own]
        searched_timings = [searched[number][0].timing for number in numbers]
        timings = self._likeliest(codebook, own, moved, noise, searched_timings, onset, others)
        shown = [shown_numbers(codebook, *each, onset) for each in zip(own, moved, timings, strict=True)]
        windows = _all_windows(codebook, own, moved, timings, shown)
        found = estimate(windows, moved, noise, self._profile, elsewhere(windows, names, timings, others))
        clock_hz = codebook.scheme.rate_hz if isinstance(onset, OnsetRange) else None
        better = refined_timing(found, windows, moved, timings, clock_hz)
        if better != timings:
            del found
            timings = better
            windows = _all_windows(codebook, own, moved, timings, shown)
            found = estimate(windows, moved, noise, self._profile, elsewhere(windows, names, timings, others))
        readings = {}
        for row, number in enumerate(numbers):
            strengths = np.array([other.evidence for other in searched[number]])
            reading = _reading(codebook, own[row], row, windows, found, timings[row], float(strengths[0]))
            readings[number] = ChannelReading(
                reading, softmax(reading.scores, axis=1), reading.window_scores, strengths[1:], prepared[number]
            )
        return readings

    def _likeliest(
        self,
        codebook: Codebook,
        channels: Sequence[Channel],
        motions: Sequence[Motion],
        noise: NoiseModel,
        found: list[Timing],
        onset: Onset,
        others: Mapping[str, Reading],
    ) -> list[Timing]:
        """The timings that were found or, where the onset is known, those near it which all plants explain best.

        The search knows one plant, and lays windows late for a robot that lags otherwise.
        """
        if not isinstance(onset, int | float):
            return found
        names = [channel.name for channel in channels]
        best, most = found, -np.inf
        for timings in _near_known(found, float(onset), codebook.scheme.rate_hz):
            shown = [shown_numbers(codebook, *each, onset) for each in zip(channels, motions, timings, strict=True)]
            if not all(map(len, shown)):
                continue
            windows = _all_windows(codebook, channels, motions, timings, shown)
            beside = elsewhere(windows, names, timings, others)
            evidence = first_evidence(windows, motions, noise, self._profile, beside)
            evidence += _log_clock_prior(timings, codebook.scheme.rate_hz)
            if evidence > most:
                best, most = timings, evidence
        return best


def _near_known(found: Sequence[Timing], onset_s: float, nominal_hz: float) -> list[list[Timing]]:
    """The timings as found, with the onset as it is known, at the nominal rate, and with both."""
    return [
        list(found),
        [replace(timing, onset_s=onset_s) for timing in found],
        [replace(timing, rate_hz=nominal_hz) for timing in found],
        [Timing(onset_s, nominal_hz) for _ in found],
    ]


def _log_clock_prior(timings: Sequence[Timing], nominal_hz: float) -> float:
    rates_hz = np.array([timing.rate_hz for timing in timings])
    prior = float(np.mean(log_rate_prior(rates_hz, nominal_hz)))
    return prior + (_NOMINAL_NATS if np.all(rates_hz == nominal_hz) else 0.0)


def _motions(glimpses: Sequence[Glimpse], codebook: Codebook) -> tuple[dict[int, Motion], dict[int, MtmError]]:
    """The motion of each glimpse by its number, and why the others have none."""
    motions: dict[int, Motion] = {}
    refusals: dict[int, MtmError] = {}
    for number, glimpse in enumerate(glimpses):
        try:
            motions[number] = uniform_motion(glimpse, codebook.scheme.band_hz[1])
        except MtmError as refusal:
            refusals[number] = refusal
    return motions, refusals


def _kinds(motions: Iterable[int], glimpses: Sequence[Glimpse]) -> list[list[int]]:
    """Numbers of the motions whose glimpses have the same axes, which are of one unit and of plants alike."""
    kinds: dict[tuple[str, ...], list[int]] = {}
    for number in motions:
        kinds.setdefault(glimpses[number].axes, []).append(number)
    return list(kinds.values())


def _prepared(motions: dict[int, Motion], glimpses: Sequence[Glimpse]) -> dict[int, Prepared]:
    """Each motion whitened by what all of its kind show of the interference, along axes that they share."""
    prepared: dict[int, Prepared] = {}
    for numbers in _kinds(motions, glimpses):
        turned = _along_principal_axes([motions[number] for number in numbers])
        noise = fit_recording_noise(turned, [motion.velocities for motion in turned])
        prepared |= {number: prepare(turned[row], noise, row) for row, number in enumerate(numbers)}
    return {number: prepared[number] for number in motions}


def _searched(
    codebooks: Sequence[Codebook],
    channels: dict[int, Channel],
    prepared: dict[int, Prepared],
    onset: Onset,
    progress: Callable[[float], None] | None,
) -> dict[int, list[Found]]:
    """For each robot, for each codebook the timing that its motion shows by itself."""
    searched: dict[int, list[Found]] = {}
    for row, (number, robot) in enumerate(prepared.items()):
        part = None if progress is None else _part_of(progress, row, len(prepared))
        played = [(codebook, channels[number]) for codebook in codebooks]
        searched[number] = search_timings(played, robot, onset, part)
    return searched


def _shared(
    codebooks: Sequence[Codebook],
    channels: dict[int, Channel],
    prepared: dict[int, Prepared],
    alone: dict[int, list[Found]],
    onset: Onset,
) -> dict[int, list[Found]]:
    """The timings once robots whose windows are of one length know what each of them found."""
    searched = dict(alone)
    lengths = {number: codebooks[0].scheme.window_ticks(channels[number]) for number in prepared}
    for length in dict.fromkeys(lengths.values()):
        fleet = [number for number, other in lengths.items() if other == length]
        if len(fleet) > 1:
            members = [Member(channels[number], prepared[number], alone[number]) for number in fleet]
            searched.update(zip(fleet, share_timings(codebooks, members, onset), strict=True))
    return searched


def _along_principal_axes(motions: Sequence[Motion]) -> list[Motion]:
    """The motions turned into axes of uncorrelated interference, the same for all that one camera sees."""
    signals = [motion.velocities for motion in motions]
    rotation = principal_axes(signals, fit_recording_noise(motions, signals))
    return [replace(motion, velocities=rotation @ motion.velocities) for motion in motions]


def _part_of(progress: Callable[[float], None], row: int, count: int) -> Callable[[float], None]:
    return lambda fraction: progress((row + fraction) / count)


def _all_windows(
    codebook: Codebook,
    channels: Sequence[Channel],
    motions: Sequence[Motion],
    timings: Sequence[Timing],
    shown: Sequence[range],
) -> list[Window]:
    windows = []
    for row, (channel, motion, timing, numbers) in enumerate(zip(channels, motions, timings, shown, strict=True)):
        windows += make_windows(codebook, channel, motion, timing, row, numbers)
    return windows


def _holds_no_part(codebook: Codebook, channel: Channel, motion: Motion) -> bool:
    """Whether the whole motion is too short for a part of a window, however fast its clock runs."""
    fastest_hz = codebook.scheme.rate_hz * (1.0 + SEARCHED_RATES)
    return len(motion.seen) * motion.step_s < LEAST_PART * codebook.scheme.window_ticks(channel) / fastest_hz


def _too_short(
    codebook: Codebook, channel: Channel, prepared: Prepared, timing: Timing, onset: Onset
) -> MtmError | None:
    """Why no window of the channel can be read from the motion; None when one can."""
    if len(shown_numbers(codebook, channel, prepared.motion, timing, onset)):
        return None
    return _less_than_a_part(codebook, channel, timing.rate_hz)


def _less_than_a_part(codebook: Codebook, channel: Channel, rate_hz: float) -> MtmError:
    length_s = codebook.scheme.window_ticks(channel) / rate_hz
    return MtmError(
        f"the recording holds less than a third of a window of {length_s:g} s of channel {channel.name!r} after the "
        "onset; record longer"
    )


def _reading(
    codebook: Codebook,
    channel: Channel,
    number: int,
    windows: Sequence[Window],
    found: Estimate,
    timing: Timing,
    strength: float,
) -> Reading:
    mine = [index for index, window in enumerate(windows) if window.observation == number]
    # One observation's windows follow each other, so that this is a part of what is held and no copy.
    ratios = found.ratios[mine[0] : mine[-1] + 1]
    numbers = np.array([windows[index].number for index in mine])
    positions = np.mod(numbers, channel.symbols)
    scores = np.zeros((channel.symbols, codebook.scheme.alphabet_size))
    np.add.at(scores, positions, ratios)
    starts_s = timing.onset_s + numbers * (codebook.scheme.window_ticks(channel) / timing.rate_hz)
    return Reading(timing, scores, ratios, numbers, positions, starts_s, strength)
