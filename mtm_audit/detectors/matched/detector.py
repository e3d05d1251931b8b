"""The matched detector behind the common interface."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import softmax

from mtm_audit.detectors.base import ChannelReading, Observation, Reading
from mtm_audit.detectors.matched.byclock import Found
from mtm_audit.detectors.matched.correlate import Prepared, prepare
from mtm_audit.detectors.matched.estimate import Estimate, estimate, fit_recording_noise
from mtm_audit.detectors.matched.fleet import Member, share_timings
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.noise import NoiseModel, principal_axes
from mtm_audit.detectors.matched.profile import PlantProfile
from mtm_audit.detectors.matched.refine import refined_timing
from mtm_audit.detectors.matched.search import search_timings
from mtm_audit.detectors.matched.windows import LEAST_PART, Window, make_windows
from mtm_audit.model.timing import Onset, Timing
from mtm_audit.model.track import Floats
from mtm_audit.significance.decoys import Evidence, weigh_log_evidence
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Channel


class MatchedDetector:
    """Whitened matched filtering with a plant shared by all windows; scores are log-likelihood ratios in nats.

    `profile` is what is known of the robots' plant beforehand, None when nothing is.
    """

    name = "matched"

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
        motions: dict[int, Motion] = {}
        refusals: dict[int, MtmError] = {}
        for number, observation in enumerate(observations):
            try:
                motions[number] = uniform_motion(observation.glimpse, codebook.scheme.band_hz[1])
            except MtmError as refusal:
                refusals[number] = refusal
        readings = self._read_together(codebook, decoys, observations, motions, onset, progress) if motions else {}
        return [readings[number] if number in readings else refusals[number] for number in range(len(observations))]

    def weigh(self, strength: float, decoy_strengths: Floats, maxima: int) -> Evidence:
        """Strengths are log evidences."""
        return weigh_log_evidence(strength, decoy_strengths)

    def _read_together(
        self,
        codebook: Codebook,
        decoys: Sequence[Codebook],
        observations: Sequence[Observation],
        motions: dict[int, Motion],
        onset: Onset,
        progress: Callable[[float], None] | None,
    ) -> dict[int, ChannelReading]:
        channels = [observations[number].channel for number in motions]
        moved = list(motions.values())
        moved = _along_principal_axes(moved)
        noise = fit_recording_noise(moved, [motion.velocities for motion in moved])
        prepared = [prepare(motion, noise, row) for row, motion in enumerate(moved)]
        searched = _searched([codebook, *decoys], channels, prepared, onset, progress)
        timings = [found[0].timing for found in searched]
        free = onset is None
        windows = _all_windows(codebook, channels, moved, timings, searched=free)
        found = estimate(windows, moved, noise, self._profile)
        better = refined_timing(found, windows, moved, timings)
        if better != timings:
            timings = better
            windows = _all_windows(codebook, channels, moved, timings, searched=free)
            found = estimate(windows, moved, noise, self._profile)
        readings = {}
        for row, number in enumerate(motions):
            strengths = np.array([other.evidence for other in searched[row]])
            reading = _reading(codebook, channels[row], row, windows, found, timings[row], float(strengths[0]))
            readings[number] = ChannelReading(
                reading, softmax(reading.scores, axis=1), reading.window_scores, strengths[1:], prepared[row]
            )
        return readings


def _searched(
    codebooks: Sequence[Codebook],
    channels: Sequence[Channel],
    prepared: Sequence[Prepared],
    onset: Onset,
    progress: Callable[[float], None] | None,
) -> list[list[Found]]:
    """For each robot, for each codebook the timing; robots whose windows are of one length share what they found."""
    searched = []
    for row, (channel, robot) in enumerate(zip(channels, prepared, strict=True)):
        part = None if progress is None else _part_of(progress, row, len(channels))
        searched.append(search_timings(codebooks, channel, robot, onset, part))
    lengths = [codebooks[0].scheme.window_ticks(channel) for channel in channels]
    for length in dict.fromkeys(lengths):
        fleet = [row for row, other in enumerate(lengths) if other == length]
        if len(fleet) > 1:
            members = [Member(channels[row], prepared[row], searched[row]) for row in fleet]
            for row, found in zip(fleet, share_timings(codebooks, members, onset), strict=True):
                searched[row] = found
    return searched


def _along_principal_axes(motions: Sequence[Motion]) -> list[Motion]:
    """The motions turned into axes of uncorrelated interference, the same for all that one camera sees."""
    if len({len(motion.velocities) for motion in motions}) > 1:
        return list(motions)
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
    *,
    searched: bool,
) -> list[Window]:
    windows = []
    for number, (channel, motion, timing) in enumerate(zip(channels, motions, timings, strict=True)):
        length_s = codebook.scheme.window_ticks(channel) / timing.rate_hz
        end_s = motion.start_s + len(motion.seen) * motion.step_s
        first = int(np.ceil((motion.start_s - timing.onset_s) / length_s - (1.0 - LEAST_PART)))
        last = int(np.floor((end_s - timing.onset_s) / length_s - LEAST_PART))
        if not searched or codebook.scheme.schedule == "rolling":
            first = max(0, first)
        if last < first:
            raise MtmError(
                f"the recording holds less than a third of a window of {length_s:g} s of channel {channel.name!r} "
                "after the onset; record longer"
            )
        windows += make_windows(codebook, channel, motion, timing, number, range(first, last + 1))
    return windows


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
    ratios = np.stack([found.ratios[index] for index in mine])
    numbers = np.array([windows[index].number for index in mine])
    positions = np.mod(numbers, channel.symbols)
    scores = np.zeros((channel.symbols, codebook.scheme.alphabet_size))
    np.add.at(scores, positions, ratios)
    starts_s = timing.onset_s + numbers * (codebook.scheme.window_ticks(channel) / timing.rate_hz)
    return Reading(timing, scores, ratios, numbers, positions, starts_s, strength, 1)
