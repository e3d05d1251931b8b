"""The paper's detector: mean magnitude of Welch coherency over the band, maximised over 101 rates, pooled over axes.

Under a spectrum, which the paper does not have, each frequency counts in proportion to its power.

Appendix "Detection Pipeline Details" of the paper: Hann window, nperseg = min(128, L / 2), three quarters overlap,
nfft = L, L being the window in ticks; the glimpse is resampled at each candidate rate.
"""

import contextlib
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from mtm_audit.detectors.base import ChannelReading, Observation, Reading, StrengthLaw, combine_repeats, whole_windows
from mtm_audit.detectors.gcc_phat import RATE_SCALES, find_onset, find_onset_within, plan_onset_search
from mtm_audit.detectors.welch import Complexes, mean_coherency, segment_spectra
from mtm_audit.model.glimpse import Glimpse, tick_velocities_at_rates
from mtm_audit.model.timing import Onset, OnsetRange, Timing
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Channel


class CoherencyDetector:
    """The paper's detector behind the common interface."""

    name = "coherency"
    strength_law: StrengthLaw = "mean of maxima"

    def read(
        self,
        codebook: Codebook,
        decoys: Sequence[Codebook],
        observations: Sequence[Observation],
        onset: Onset,
        progress: Callable[[float], None] | None = None,
    ) -> list[ChannelReading | MtmError]:
        """Read the channels one by one; each has its own timing. Raises MtmError without decoys."""
        if not decoys:
            raise MtmError(
                "the coherency detector measures chance scores on decoys and got none; give one decoy at least"
            )
        results: list[ChannelReading | MtmError] = []
        for number, observation in enumerate(observations):
            if progress is not None:
                progress(number / len(observations))
            try:
                own, *others = self.read_channel([codebook, *decoys], observation.channel, observation.glimpse, onset)
            except MtmError as refusal:
                results.append(refusal)
            else:
                strengths = np.array([other.strength for other in others])
                ratios = self.window_ratios(own, others)
                results.append(ChannelReading(own, self.posteriors(own, others), ratios, strengths))
        return results

    def read_channel(
        self, codebooks: Sequence[Codebook], channel: Channel, glimpse: Glimpse, onset: Onset
    ) -> list[Reading]:
        """Score every window; without an onset, GCC-PHAT finds one for each codebook at each candidate rate."""
        scheme = codebooks[0].scheme
        ticks = scheme.window_ticks(channel)
        axes = own_axes(channel, glimpse)
        if isinstance(onset, int | float):
            timing = Timing(onset, scheme.rate_hz)
            return self._score_group(codebooks, [timing] * len(codebooks), channel, axes, searched=False)
        rates_hz = scheme.rate_hz * RATE_SCALES
        band = np.array(scheme.band_hz) / scheme.rate_hz
        spectrum = scheme.spectrum and tuple((hz / scheme.rate_hz, level_db) for hz, level_db in scheme.spectrum)
        plan = plan_onset_search(axes, rates_hz, band, ticks, spectrum)
        if isinstance(onset, OnsetRange):
            # At the fastest rate the most windows fit between the earliest onset and the recording's end.
            numbered = int(np.ceil((glimpse.edges_s[-1] - onset.low_s) * rates_hz[-1] / ticks))
            timings = [
                find_onset_within(plan, [codebook.samples(channel, n) for n in range(numbered)], onset, ticks)
                for codebook in codebooks
            ]
        else:
            distinct = 1 if scheme.schedule == "fixed" else channel.symbols
            timings = [
                find_onset(plan, [codebook.samples(channel, n) for n in range(distinct)], channel.symbols, ticks)
                for codebook in codebooks
            ]
        return self._score_group(codebooks, timings, channel, axes, searched=True)

    def posteriors(self, reading: Reading, decoys: Sequence[Reading]) -> Floats:
        """Posteriors under a Gaussian shift: a sent symbol's score lies higher than a null score by a common amount.

        Mean and spread of null scores come from the decoys, position by position; the shift is what the best
        candidates show over all positions of the channel.
        """
        null = np.stack([decoy.scores for decoy in decoys])
        centre = null.mean(axis=(0, 2))
        variance = null.var(axis=(0, 2))
        shift = max(0.0, float(np.mean(reading.scores.max(axis=1) - centre)))
        logs = shift * (reading.scores - centre[:, None]) / np.maximum(variance, 1e-12)[:, None]
        return np.asarray(softmax(logs, axis=1))

    def window_ratios(self, reading: Reading, decoys: Sequence[Reading]) -> Floats:
        """Log-likelihood ratios (windows, M) under the same law as `posteriors`, each window by itself."""
        null = np.concatenate([decoy.window_scores.ravel() for decoy in decoys])
        centre, variance = float(null.mean()), max(float(null.var()), 1e-12)
        shift = max(0.0, float(np.mean(reading.window_scores.max(axis=1) - centre)))
        return np.asarray(shift / variance * (reading.window_scores - centre))

    def strengths(
        self,
        codebooks: Sequence[Codebook],
        channels: Sequence[Channel],
        glimpses: Sequence[Glimpse],
        onset: Onset,
        *,
        usual_rates: bool = False,
    ) -> Floats:
        """Mean best coherency of each channel in each glimpse, (codebooks, channels, glimpses); NaN where unread."""
        result = np.full((len(codebooks), len(channels), len(glimpses)), np.nan)
        for row, channel in enumerate(channels):
            for column, glimpse in enumerate(glimpses):
                with contextlib.suppress(MtmError):
                    read = self.read_channel(codebooks, channel, glimpse, onset)
                    result[:, row, column] = [reading.strength for reading in read]
        return result

    def _score_group(
        self,
        codebooks: Sequence[Codebook],
        timings: Sequence[Timing],
        channel: Channel,
        glimpse: Glimpse,
        *,
        searched: bool,
    ) -> list[Reading]:
        """Score all codebooks; those that share a timing share the observed spectra."""
        readings: list[Reading | None] = [None] * len(codebooks)
        for timing in dict.fromkeys(timings):
            members = [index for index, other in enumerate(timings) if other == timing]
            group = [codebooks[index] for index in members]
            for index, reading in zip(members, _read_at(group, channel, glimpse, timing, searched), strict=True):
                readings[index] = reading
        return [reading for reading in readings if reading is not None]


def rate_searched_scores(
    codebook: Codebook, channel: Channel, glimpse: Glimpse, onset_s: float, window: int = 0
) -> Floats:
    """The paper's score of each candidate in one window: best mean coherency over the 101 rates, shape (M,)."""
    observed = _observed_spectra(own_axes(channel, glimpse), codebook, channel, onset_s, window)
    references = _reference_spectra([codebook], channel, window)[0]
    best: Floats = mean_coherency(references, observed, _powers(codebook, channel)).max(axis=1)
    return best


def _read_at(
    codebooks: Sequence[Codebook], channel: Channel, glimpse: Glimpse, timing: Timing, searched: bool
) -> list[Reading]:
    scheme = codebooks[0].scheme
    ticks = scheme.window_ticks(channel)
    backwards = searched and scheme.schedule == "fixed"
    windows = whole_windows(glimpse, timing, ticks, backwards=backwards)
    if not len(windows):
        length_s = ticks / scheme.rate_hz
        raise MtmError(
            f"the recording of {glimpse.name!r} holds no whole window of {length_s:g} s after the onset; record at "
            f"least {channel.symbols * length_s:g} s of the message"
        )
    count, size = len(codebooks), scheme.alphabet_size
    scores = np.empty((count, len(windows), size))
    references: list[Complexes] | None = None
    powers = _powers(codebooks[0], channel)
    for row, window in enumerate(windows):
        if references is None or scheme.schedule == "rolling":
            references = _reference_spectra(codebooks, channel, int(window))
        # Rates scale the time since the onset, so the search stays the paper's however late the window is.
        observed = _observed_spectra(glimpse, codebooks[0], channel, timing.onset_s, int(window))
        for number, reference in enumerate(references):
            scores[number, row] = mean_coherency(reference, observed, powers).max(axis=1)
    starts_s = timing.onset_s + windows * ticks / timing.rate_hz
    return [_reading(timing, scores[number], windows, starts_s, channel.symbols) for number in range(count)]


def _reading(timing: Timing, scores: Floats, numbers: NDArray[np.int64], starts_s: Floats, symbols: int) -> Reading:
    positions = np.mod(numbers, symbols)
    combined = combine_repeats(scores, positions, symbols)
    seen = np.isin(np.arange(symbols), positions)
    strength = float(combined[seen].max(axis=1).mean())
    return Reading(timing, combined, scores, numbers, positions, starts_s, strength)


def _powers(codebook: Codebook, channel: Channel) -> Floats | None:
    """What each bin counts, (K,) of mean 1; None where all count alike, as in the paper."""
    return None if codebook.scheme.spectrum is None else codebook.tone_powers(channel)


def _reference_spectra(codebooks: Sequence[Codebook], channel: Channel, window: int) -> list[Complexes]:
    bins = codebooks[0].bins(channel)
    return [segment_spectra(codebook.samples(channel, window), bins) for codebook in codebooks]


def _observed_spectra(glimpse: Glimpse, codebook: Codebook, channel: Channel, onset_s: float, window: int) -> Complexes:
    scheme = codebook.scheme
    ticks = scheme.window_ticks(channel)
    rates_hz = scheme.rate_hz * RATE_SCALES
    observed = tick_velocities_at_rates(glimpse, onset_s + window * ticks / rates_hz, rates_hz, ticks)
    return segment_spectra(observed, codebook.bins(channel))


def own_axes(channel: Channel, glimpse: Glimpse) -> Glimpse:
    """The observed axes that stand for the channel's own, in order: those of their names, or else the first ones.

    Raises MtmError when the track has fewer axes than the channel.
    """
    count = len(channel.axes)
    if glimpse.velocities.shape[1] < count:
        raise MtmError(
            f"track {glimpse.name!r} shows {glimpse.velocities.shape[1]} axes but channel {channel.name!r} has {count};"
            " use a tracker that sees them all"
        )
    # The velocity vx is seen on the axis x.
    named = [axis if axis in glimpse.axes else axis.removeprefix("v") for axis in channel.axes]
    columns = [glimpse.axes.index(name) for name in named] if set(named) <= set(glimpse.axes) else list(range(count))
    axes = tuple(glimpse.axes[column] for column in columns)
    return Glimpse(glimpse.name, glimpse.edges_s, glimpse.velocities[:, columns], glimpse.valid, axes)
