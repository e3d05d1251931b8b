"""The matched detector behind the common interface."""

from collections.abc import Callable, Sequence

import numpy as np

from mtm_audit.detectors.base import Observation, Reading
from mtm_audit.detectors.matched.estimate import Estimate, estimate, fit_recording_noise
from mtm_audit.detectors.matched.evidence import log_sum_exp
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.noise import NoiseModel
from mtm_audit.detectors.matched.refine import refined_timing
from mtm_audit.detectors.matched.search import Prepared, prepare, search_timing
from mtm_audit.detectors.matched.windows import Window, make_window
from mtm_audit.timing import Timing
from mtm_audit.tracks import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Channel

# A window counts when at least this part of it is in the recording.
_LEAST_PART = 0.3


class MatchedDetector:
    """Whitened matched filtering with a plant shared by all windows; scores are log-likelihood ratios in nats."""

    name = "matched"

    def read(
        self,
        codebooks: Sequence[Codebook],
        observations: Sequence[Observation],
        onset_s: float | None,
        progress: Callable[[float], None] | None = None,
    ) -> list[list[Reading] | MtmError]:
        """Read all observations together; timing is searched for each codebook and observation."""
        highest_hz = codebooks[0].scheme.band_hz[1]
        motions: dict[int, Motion] = {}
        results: list[list[Reading] | MtmError] = [[] for _ in observations]
        for number, observation in enumerate(observations):
            try:
                motions[number] = uniform_motion(observation.glimpse, highest_hz)
            except MtmError as refusal:
                results[number] = refusal
        if not motions:
            return results
        readable = [observations[number] for number in motions]
        moved = list(motions.values())
        noise = fit_recording_noise(moved, [motion.velocities for motion in moved])
        prepared = [prepare(motion, noise, number) for number, motion in enumerate(moved)]
        for done, codebook in enumerate(codebooks):
            if progress is not None:
                progress(done / len(codebooks))
            readings = self._read_one(codebook, readable, moved, prepared, noise, onset_s)
            for number, reading in zip(motions, readings, strict=True):
                collected = results[number]
                if isinstance(collected, list):
                    collected.append(reading)
        return results

    def posteriors(self, reading: Reading, decoys: Sequence[Reading]) -> Floats:
        """Symbol probabilities from the log-likelihood ratios, equal odds before: (positions, M)."""
        posteriors: Floats = np.exp(reading.scores - log_sum_exp(reading.scores, axis=1)[:, None])
        return posteriors

    def _read_one(
        self,
        codebook: Codebook,
        observations: Sequence[Observation],
        motions: Sequence[Motion],
        prepared: Sequence[Prepared],
        noise: NoiseModel,
        onset_s: float | None,
    ) -> list[Reading]:
        channels = [observation.channel for observation in observations]
        timings = [
            search_timing(codebook, channel, ready, onset_s) for channel, ready in zip(channels, prepared, strict=True)
        ]
        windows = _all_windows(codebook, channels, motions, timings, searched=onset_s is None)
        found = estimate(windows, motions, noise)
        better = refined_timing(found, windows, motions, timings)
        if better != timings:
            timings = better
            windows = _all_windows(codebook, channels, motions, timings, searched=onset_s is None)
            found = estimate(windows, motions, noise)
        return [
            _reading(codebook, channel, number, windows, found, timings[number])
            for number, channel in enumerate(channels)
        ]


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
        first = int(np.ceil((motion.start_s - timing.onset_s) / length_s - (1.0 - _LEAST_PART)))
        last = int(np.floor((end_s - timing.onset_s) / length_s - _LEAST_PART))
        if not searched or codebook.scheme.schedule == "rolling":
            first = max(0, first)
        if last < first:
            raise MtmError(
                f"the recording holds less than a third of a window of {length_s:g} s of channel {channel.name!r} "
                "after the onset; record longer"
            )
        windows += [
            make_window(codebook, channel, motion, timing, number, window, window % channel.symbols)
            for window in range(first, last + 1)
        ]
    return windows


def _reading(
    codebook: Codebook, channel: Channel, number: int, windows: Sequence[Window], found: Estimate, timing: Timing
) -> Reading:
    mine = [index for index, window in enumerate(windows) if window.observation == number]
    ratios = np.stack([found.ratios[index] for index in mine])
    numbers = np.array([windows[index].number for index in mine])
    scores = np.zeros((channel.symbols, codebook.scheme.alphabet_size))
    positions = np.mod(numbers, channel.symbols)
    np.add.at(scores, positions, ratios)
    length_s = codebook.scheme.window_ticks(channel) / timing.rate_hz
    per_position = log_sum_exp(scores, axis=1) - np.log(scores.shape[1])
    strength = float(np.sum(np.logaddexp(0.0, per_position) - np.log(2.0)))
    return Reading(timing, scores, ratios, positions, timing.onset_s + numbers * length_s, strength, 1)
