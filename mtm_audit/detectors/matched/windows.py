"""Windows of a recording as linear models of the waveforms' tones, and what the data say about them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.candidates import WindowTones
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.noise import NoiseModel, whitened, whitened_from_silence
from mtm_audit.detectors.matched.plants import TAIL_S, Plants, tone_responses
from mtm_audit.model.timing import Onset, Timing
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel

# As the dtype is: either way what is told of windows is in full precision.
Heard = NDArray[np.float64] | NDArray[np.float32]

# A window counts when at least this part of it is in the recording.
LEAST_PART = 0.3
# Candidates whose products with all plants' moments are held at once.
_TOGETHER = 128


@dataclass(frozen=True)
class Window:
    """One window of one observation.

    `observation` numbers the observation, `number` the window from the onset on, `group` is shared by the windows
    that repeat the same symbol. `first` and `last` bound the cells that hear the window (its tail included);
    `since_start_s` (n,) are their middles. `tones` are the candidates', so that a waveform is `tones.of` it times the
    rows of `response_rows`.
    """

    observation: int
    number: int
    group: int
    first: int
    last: int
    since_start_s: Floats
    length_s: float
    tones_hz: Floats
    tones: WindowTones


@dataclass(frozen=True)
class Statistics:
    """What the data say about candidates of a window under each plant, in units of the noise.

    `information` (observed axes, L, plants, A) and `precision` (observed axes, L, plants, A, A): a candidate whose
    injected axes reach an observed axis with gains g has log-likelihood ratio  g . information - g' precision g / 2.
    """

    information: Floats
    precision: Floats


def shown_numbers(codebook: Codebook, channel: Channel, motion: Motion, timing: Timing, onset: Onset) -> range:
    """Which windows from the onset on the motion shows enough of; under a fixed schedule earlier ones repeat it."""
    length_s = codebook.scheme.window_ticks(channel) / timing.rate_hz
    end_s = motion.start_s + len(motion.seen) * motion.step_s
    first = int(np.ceil((motion.start_s - timing.onset_s) / length_s - (1.0 - LEAST_PART)))
    last = int(np.floor((end_s - timing.onset_s) / length_s - LEAST_PART))
    if onset is not None or codebook.scheme.schedule == "rolling":
        first = max(0, first)
    return range(first, last + 1)


def make_windows(
    codebook: Codebook, channel: Channel, motion: Motion, timing: Timing, observation: int, numbers: Sequence[int]
) -> list[Window]:
    """Windows of one channel, in groups by the message position that they carry.

    Under the fixed schedule they share one array of tones, so that the waveforms are derived and held once.
    """
    windows: list[Window] = []
    for number in numbers:
        shared = windows[0].tones if windows and codebook.scheme.schedule == "fixed" else None
        group = number % channel.symbols
        windows.append(make_window(codebook, channel, motion, timing, observation, number, group, shared))
    return windows


def make_window(
    codebook: Codebook,
    channel: Channel,
    motion: Motion,
    timing: Timing,
    observation: int,
    number: int,
    group: int,
    tones: WindowTones | None = None,
) -> Window:
    """The window that begins `number` window lengths after the onset; it may lie partly outside the recording.

    `tones` are its candidates' where they are at hand.
    """
    ticks = codebook.scheme.window_ticks(channel)
    length_s = ticks / timing.rate_hz
    middles_s = motion.middles_s
    start_s = timing.onset_s + number * length_s
    first, last = np.searchsorted(middles_s, [start_s, start_s + length_s + TAIL_S])
    return Window(
        observation,
        number,
        group,
        int(first),
        int(last),
        middles_s[first:last] - start_s,
        length_s,
        codebook.bins(channel) * (timing.rate_hz / ticks),
        WindowTones(codebook, channel, number) if tones is None else tones,
    )


def response_rows(window: Window, plants: Plants) -> Floats:
    """Each plant's response to the window's tones in its cells: (plants, 2 K, n)."""
    responses = tone_responses(plants, window.tones_hz, window.since_start_s, window.length_s)
    return np.concatenate([responses.real, -responses.imag], axis=1)


def statistics(window: Window, tones: Floats, rows: Floats, noise: NoiseModel, residual: Floats) -> Statistics:
    """Correlate candidates with the data: `tones` (L, A, 2 K), `rows` (plants, 2 K, n), `residual` (axes, cells).

    `residual` is the observed motion less what all other windows are believed to add.
    """
    pulled, weights, filters, history = pulled_by(window, noise, residual)
    count, axes, width = tones.shape
    flat = tones.reshape(count * axes, width)
    information = np.empty((len(pulled), count, len(rows), axes))
    precision = np.empty((len(pulled), count, len(rows), axes, axes))
    few = len(flat) <= width
    # Few candidates are cheapest as waveforms, many as quadratic forms of their tones; either way what is fewer is
    # whitened, once for all axes whose filter is the same.
    signals: Heard = flat @ rows if few else rows.astype(np.float32)
    for mine, heard in whitened_by_filter(signals, filters, history):
        found = (
            _from_waveforms(heard.reshape(len(rows), count, axes, -1), pulled[mine], weights[mine])
            if few
            else _from_tones(flat, axes, heard, pulled[mine], weights[mine])
        )
        information[mine], precision[mine] = found.information, found.precision
    return Statistics(information, precision)


def pulled_by(window: Window, noise: NoiseModel, residual: Floats) -> tuple[Floats, Floats, Floats, int]:
    """What templates of a window are correlated with: the whitened residual in units of the noise and times its
    weights, and those weights, (observed axes, n) each; the whitening filters; how many cells of history they have.
    """
    order, filters = noise.order, noise.filters[window.observation]
    before = max(0, window.first - order)
    observed = whitened(residual[:, before : window.last], filters)
    scales = noise.scales[window.observation]
    weights = noise.weights[window.observation][:, before + order : window.last]
    return weights / scales[:, None] * observed, weights, filters, window.first - before


def whitened_by_filter(signals: Heard, filters: Floats, history: int) -> list[tuple[NDArray[np.int64], Heard]]:
    """Signals whitened from silence, once for each filter and the observed axes that have it."""
    return [
        (np.flatnonzero(np.all(filters == own, axis=1)), whitened_from_silence(signals, history, own))
        for own in np.unique(filters, axis=0)
    ]


def _from_waveforms(waveforms: Heard, pulled: Floats, weights: Floats) -> Statistics:
    """`waveforms` (plants, L, A, n) whitened, `pulled` and `weights` (observed axes, n)."""
    plants, candidates, axes, _ = waveforms.shape
    information = np.einsum("plan,dn->dlpa", waveforms, pulled, optimize=True)
    precision = np.empty((len(pulled), candidates, plants, axes, axes))
    for one in range(axes):
        for other in range(one, axes):
            product = (waveforms[:, :, one] * waveforms[:, :, other]) @ weights.T
            precision[..., one, other] = precision[..., other, one] = product.transpose(2, 1, 0)
    return Statistics(information, precision)


def _from_tones(flat: Floats, axes: int, heard: Heard, pulled: Floats, weights: Floats) -> Statistics:
    """The same numbers through the tones' second moments, with products in the precision of `heard`."""
    plants, width = heard.shape[:2]
    tones = flat.astype(heard.dtype).reshape(-1, axes, width)
    count = len(tones)
    information = np.empty((len(pulled), count, plants, axes))
    precision = np.empty((len(pulled), count, plants, axes, axes))
    for axis in range(len(pulled)):
        projection = (heard @ pulled[axis].astype(heard.dtype)).astype(np.float64)
        information[axis] = (flat @ projection.T).reshape(count, axes, plants).transpose(0, 2, 1)
        # Written as a square, of which half is computed.
        weighted = heard * np.sqrt(weights[axis]).astype(heard.dtype)
        moments = (weighted @ weighted.transpose(0, 2, 1)).transpose(1, 0, 2).reshape(width, plants * width)
        for first in range(0, count, _TOGETHER):
            some = tones[first : first + _TOGETHER]
            turned = (some.reshape(-1, width) @ moments).reshape(len(some), axes * plants, width)
            products = (turned @ some.transpose(0, 2, 1)).reshape(len(some), axes, plants, axes)
            precision[axis, first : first + _TOGETHER] = products.transpose(0, 2, 1, 3)
    return Statistics(information, precision)
