"""The noise that a drive is under: a key's, unkeyed noise of the same power, or none."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.track import Floats
from mtm_onboard.model.velocity import AXES, BodyVelocity
from mtm_onboard.protocol import Channel, Codebook, MtmError, Scheme
from mtm_onboard.protocol.waveform import band_tones, channel_tones, evaluate_window, tone_bins
from mtm_onboard.runtime.modulator import Modulator

CLEAN, WHITE, SAME_BAND, SAME_LAW, KEYED = "clean", "white", "same band", "same law", "keyed"
# What a cost is told of.
CONDITIONS = (CLEAN, WHITE, KEYED)

# As long as noise is drawn for; a drive without noise takes 30 to 35 s.
LONGEST_S = 60.0

_KEYS_STREAM, _NOISE_STREAM, _BAND_STREAM, _LAW_STREAM = 7, 8, 9, 12

# A base command and the number of its tick to what is sent.
Add = Callable[[int, BodyVelocity], BodyVelocity]


def noise_of(scheme: Scheme, condition: str, seed: int) -> Add:
    """What is added to the commands of the scheme's first body, under one of the five conditions.

    White noise has the standard deviations of its channels on their axes, noise of the same band their spectrum as
    well, and noise of the same law their windows too; keyed noise is what the robot's modulators add under a key of
    the seed's own. Raises MtmError when a joint is among these axes.
    """
    channels = [channel for channel in scheme.channels if channel.body == scheme.channels[0].body]
    if condition == CLEAN:
        return lambda _, base: base
    for channel in channels:
        if not set(channel.axes) <= set(AXES):
            raise MtmError(
                f"channel {channel.name!r} has the axes {', '.join(channel.axes)}, but only {', '.join(AXES)} can be "
                "added to a body velocity; choose a key whose first body has those"
            )
    if condition == KEYED:
        return _keyed(scheme, channels, np.random.default_rng([_KEYS_STREAM, seed]))
    if condition == WHITE:
        return _white(channels, np.random.default_rng([_NOISE_STREAM, seed]))
    if condition == SAME_BAND:
        return _of_the_band(scheme, channels, np.random.default_rng([_BAND_STREAM, seed]))
    return _of_the_law(scheme, channels, np.random.default_rng([_LAW_STREAM, seed]))


def _keyed(scheme: Scheme, channels: Sequence[Channel], draw: np.random.Generator) -> Add:
    codebook = Codebook(draw.bytes(32), scheme)
    symbols = [draw.integers(scheme.alphabet_size, size=channel.symbols).tolist() for channel in channels]
    modulators = [Modulator(codebook, *each) for each in zip([own.name for own in channels], symbols, strict=True)]

    def play(tick: int, base: BodyVelocity) -> BodyVelocity:
        for modulator in modulators:
            base = modulator.add(tick, base)
            modulator.prepare(tick)
        return base

    return play


def _of_the_band(scheme: Scheme, channels: Sequence[Channel], draw: np.random.Generator) -> Add:
    """Stationary Gaussian noise, which knows of no windows."""
    count = _longest_ticks(scheme)
    tones = tone_bins(count, scheme.rate_hz, scheme.band_hz)
    _, powers = band_tones(scheme, count)

    def drawn() -> Floats:
        amplitudes = np.sqrt(powers / len(tones)) * draw.rayleigh(size=len(tones))
        return _sum_of_tones(count, tones, amplitudes, draw)

    return _added(channels, count, lambda _: drawn())


def _of_the_law(scheme: Scheme, channels: Sequence[Channel], draw: np.random.Generator) -> Add:
    """Window after window of new tones, drawn as those of a message but from no key."""
    longest = _longest_ticks(scheme)

    def drawn(channel: Channel) -> Floats:
        count = scheme.window_ticks(channel)
        tones = tone_bins(count, scheme.rate_hz, scheme.band_hz)
        roots = np.sqrt(channel_tones(scheme, channel)[1])
        windows = []
        for _ in range(-(-longest // count)):
            amplitudes = draw.rayleigh(size=len(tones))
            power = np.sum(amplitudes**2) / 2.0 if scheme.power == "window" else len(tones)
            windows.append(_sum_of_tones(count, tones, roots * amplitudes / np.sqrt(power), draw))
        return np.concatenate(windows)[:longest]

    return _added(channels, longest, drawn)


def _added(channels: Sequence[Channel], count: int, drawn: Callable[[Channel], Floats]) -> Add:
    """Adds noise of unit variance that is drawn for each axis, as loud as the channels say."""
    noise = np.zeros((count, len(AXES)))
    for channel in channels:
        for axis, sigma in zip(channel.axes, channel.sigmas, strict=True):
            noise[:, AXES.index(axis)] += sigma * drawn(channel)
    return lambda tick, base: BodyVelocity(*(base + noise[tick]))


def _sum_of_tones(count: int, bins: NDArray[np.int64], amplitudes: Floats, draw: np.random.Generator) -> Floats:
    """(count,): tones of these bins and amplitudes with phases at random."""
    return evaluate_window(amplitudes * np.exp(1j * draw.uniform(0.0, 2.0 * np.pi, len(bins))), bins, count)


def _longest_ticks(scheme: Scheme) -> int:
    return int(LONGEST_S * scheme.rate_hz)


def _white(channels: Sequence[Channel], draw: np.random.Generator) -> Add:
    variances = np.zeros(len(AXES))
    for channel in channels:
        for axis, sigma in zip(channel.axes, channel.sigmas, strict=True):
            variances[AXES.index(axis)] += sigma**2
    return lambda _, base: BodyVelocity(*(base + np.sqrt(variances) * draw.standard_normal(len(AXES))))
