"""The linear genie for one robot of any plant: the word is explained in `hil.experiments.detectors.genie`.

It is given how far each symbol moves each observed axis, by a linear response; the heading, the onset and the clock;
the symbols of all other windows; and the statistics of the interference, one autoregression an axis.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from hil.experiments.detectors.body_frame import in_body_frame
from hil.experiments.detectors.genie import Interference, log_likelihoods
from hil.fleet.sending import STEP_S, Sending
from hil.plants.linear_response import LinearResponse
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.noise import fit_noise
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.track import Floats, Track

_AXES = ("vx", "vy", "wz")
# How long a response lasts beyond its window.
TAIL_S = 3.0
_ORDER = 16
_COURSE_KEEP = 0.95


@dataclass(frozen=True)
class GenieKnowledge:
    """`moved` (M, observed axes, instants of `STEP_S`): how far each symbol, played in one window from time 0 on, has
    moved each axis; `interference` of each of those axes.
    """

    moved: Floats
    interference: tuple[Interference, ...]


def genie_scores(seen: Motion, sending: Sending, known: GenieKnowledge, windows: int) -> Floats:
    """Log-likelihoods, nats, of each symbol in the first `windows` windows that `sending` plays, (windows, M).

    Those of a window are known up to a constant.
    """
    length_s = window_s(sending)
    edges_s = seen.start_s + np.arange(len(seen.seen) + 1) * seen.step_s - sending.onset_s
    last = min(int(np.ceil(edges_s[-1] / length_s)), sending.messages * len(sending.symbols))
    numbers = range(max(0, int(np.floor((edges_s[0] - TAIL_S) / length_s))), last)
    candidates = {n: _at(known.moved, edges_s - n * length_s) / seen.step_s for n in numbers}
    sent = {number: sending.symbols[number % len(sending.symbols)] for number in numbers}
    unexplained = seen.velocities - sum(candidates[number][sent[number]] for number in numbers)
    before = max(len(own.filter) for own in known.interference)
    scores = np.empty((windows, len(known.moved)))
    for window in range(windows):
        start = int((window * length_s - edges_s[0]) / seen.step_s)
        bins = slice(max(0, start - before), start + int((length_s + TAIL_S) / seen.step_s))
        residual = (unexplained + candidates[window][sent[window]])[:, bins] * seen.seen[bins]
        tried = candidates[window][:, :, bins] * seen.seen[bins]
        scores[window] = sum(
            log_likelihoods(residual[axis : axis + 1], tried[:, axis : axis + 1], own)
            for axis, own in enumerate(known.interference)
        )
    return scores


def window_s(sending: Sending) -> float:
    """Length of one window by the robot's own clock."""
    scheme = sending.codebook.scheme
    return scheme.window_ticks(sending.channel) / (scheme.rate_hz * sending.rate_scale)


def symbol_noise(sending: Sending) -> Floats:
    """(M, instants of `STEP_S`, axes): the noise of each symbol, played in one window from time 0 on, and its tail."""
    grid_s = np.arange(round((window_s(sending) + TAIL_S) / STEP_S), dtype=np.float64) * STEP_S
    alphabet = range(sending.codebook.scheme.alphabet_size)
    return np.array([replace(sending, symbols=(symbol,), onset_s=0.0, messages=1).noise(grid_s) for symbol in alphabet])


def travelled(velocities: Floats) -> Floats:
    """Displacements from rest, (..., axes, instants + 1), of velocities (..., instants, axes)."""
    moved = STEP_S * np.cumsum(np.swapaxes(velocities, -1, -2), axis=-1)
    return np.concatenate([np.zeros((*moved.shape[:-1], 1)), moved], axis=-1)


def moved_by_responses(sending: Sending, responses: Mapping[str, LinearResponse]) -> Floats:
    """`GenieKnowledge.moved` for channel axes that follow each by a linear response of its own."""
    followed = [
        np.stack([responses[axis].followed(noise[:, row], STEP_S) for row, axis in enumerate(sending.channel.axes)], 1)
        for noise in symbol_noise(sending)
    ]
    return travelled(np.array(followed))


def fit_interference(motions: Sequence[Motion], axis: int) -> Interference:
    """The autoregression of one axis that leaves the smaller innovations: of the motion itself, or of its steps.

    A strong course below the band would else hide the quiet interference within it from the fit.
    """
    fits = []
    for keep in (0.0, _COURSE_KEEP):
        before = np.array([1.0, -keep])
        filtered = [signal.lfilter(before, [1.0], motion.velocities[axis : axis + 1]) for motion in motions]
        noise = fit_noise(filtered, [motion.seen for motion in motions], _ORDER)
        scale = np.sqrt(np.mean(np.square([scales[0] for scales in noise.scales])))
        fits.append(Interference(np.convolve(noise.filters[0][0], before), np.array([scale])))
    return min(fits, key=lambda fit: float(fit.scales[0]))


def axis_motion(track: Track, axes: tuple[str, ...], highest_hz: float, *, body: bool) -> Motion:
    """The motion along a channel's axes in time bins that suit the band: world velocities, or those of the body."""
    motion = uniform_motion(glimpse_of_track(in_body_frame(track) if body else track), highest_hz)
    return replace(motion, velocities=motion.velocities[[_AXES.index(axis) for axis in axes]])


def _at(moved: Floats, since_s: Floats) -> Floats:
    """(M, axes, bins): displacement in each time bin between instants `since_s` after the window's start."""
    place = np.clip(since_s / STEP_S, 0.0, moved.shape[2] - 1)
    below = np.minimum(place.astype(np.int64), moved.shape[2] - 2)
    part = place - below
    at_edges = moved[:, :, below] * (1.0 - part) + moved[:, :, below + 1] * part
    return np.asarray(np.diff(at_edges, axis=2))
