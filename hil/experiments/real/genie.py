"""The linear genie for messages added to recorded motion, see `hil.experiments.detectors.genie` for the word.

It is given the response of each axis, the heading, the onset and the clock, the symbols of all other windows, and the
statistics of the interference: one autoregression an axis, fitted to the same motion before the message was added.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from hil.experiments.detectors.genie import ORDER, Interference, log_likelihoods
from hil.experiments.real.added import Frame, known_headings, middles, turned
from hil.fleet.sending import STEP_S, Sending
from hil.plants.linear_response import LinearResponse
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.noise import fit_noise
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.track import Floats, Track

_AXES = ("vx", "vy", "wz")
_TAIL_S = 3.0
_COURSE_KEEP = 0.95


def genie_symbols(
    silent: Track,
    seen: Track,
    sending: Sending,
    responses: Mapping[str, LinearResponse],
    frame: Frame,
    windows: int,
) -> NDArray[np.int64]:
    """The likeliest symbol of each of the first `windows` windows, (windows,).

    `silent` is the recorded motion, `seen` the same with what `sending` plays.
    """
    scheme, axes = sending.codebook.scheme, sending.channel.axes
    before, after = (axis_motion(track, axes, frame, scheme.band_hz[1]) for track in (silent, seen))
    interference = [_interference(before, axis) for axis in range(len(axes))]
    length_s = scheme.window_ticks(sending.channel) / (scheme.rate_hz * sending.rate_scale)
    moved = _displacements(sending, responses)
    edges_s = after.start_s + np.arange(len(after.seen) + 1) * after.step_s
    first = int(np.floor((edges_s[0] - sending.onset_s - _TAIL_S) / length_s))
    last = int(np.ceil((edges_s[-1] - sending.onset_s) / length_s))
    numbers = range(max(first, 0), last)
    candidates = {n: _at(moved, edges_s - sending.onset_s - n * length_s) / after.step_s for n in numbers}
    sent = {number: sending.symbols[number % len(sending.symbols)] for number in numbers}
    unexplained = after.velocities - sum(candidates[number][sent[number]] for number in numbers)
    decided = np.empty(windows, dtype=np.int64)
    for window in range(windows):
        start = int((sending.onset_s + window * length_s - edges_s[0]) / after.step_s)
        bins = slice(max(0, start - ORDER - 1), start + int((length_s + _TAIL_S) / after.step_s))
        residual = (unexplained + candidates[window][sent[window]])[:, bins] * after.seen[bins]
        tried = candidates[window][:, :, bins] * after.seen[bins]
        scores = sum(
            log_likelihoods(residual[axis : axis + 1], tried[:, axis : axis + 1], interference[axis])
            for axis in range(len(axes))
        )
        decided[window] = np.argmax(scores)
    return decided


def axis_motion(track: Track, axes: tuple[str, ...], frame: Frame, highest_hz: float) -> Motion:
    """The motion along the channel's axes in time bins that suit the band: world velocities, or those of the body."""
    if frame == "body":
        track = _in_body_frame(track)
    motion = uniform_motion(glimpse_of_track(track), highest_hz)
    return replace(motion, velocities=motion.velocities[[_AXES.index(axis) for axis in axes]])


def _in_body_frame(track: Track) -> Track:
    """Distance ahead, distance to the left and heading of the body, from where it was first seen."""
    kept = track.valid & known_headings(track)
    headings = np.unwrap(track.headings_rad[kept])  # type: ignore[index]
    own = turned(np.diff(track.positions[kept], axis=0), -middles(headings))
    travelled = np.concatenate([[[0.0, 0.0]], np.cumsum(own, axis=0)])
    return Track(
        track.name, track.times_s[kept], np.column_stack([travelled, headings]), np.ones(len(headings), bool),
        axes=("ahead", "left", "heading"),
    )  # fmt: skip


def _interference(silent: Motion, axis: int) -> Interference:
    """The autoregression that leaves the smaller innovations: of the motion itself, or of its steps.

    A strong course below the band would else hide the quiet interference within it from the fit.
    """
    fits = []
    for keep in (0.0, _COURSE_KEEP):
        before = np.array([1.0, -keep])
        noise = fit_noise([signal.lfilter(before, [1.0], silent.velocities[axis : axis + 1])], [silent.seen], ORDER)
        fits.append(Interference(np.convolve(noise.filter, before), noise.scales[0]))
    return min(fits, key=lambda fit: float(fit.scales[0]))


def _displacements(sending: Sending, responses: Mapping[str, LinearResponse]) -> Floats:
    """(M, axes, instants): how far each symbol, played in one window from time 0 on, moves each axis."""
    scheme = sending.codebook.scheme
    length_s = scheme.window_ticks(sending.channel) / (scheme.rate_hz * sending.rate_scale)
    grid_s = np.arange(round((length_s + _TAIL_S) / STEP_S), dtype=np.float64) * STEP_S
    moved = []
    for symbol in range(scheme.alphabet_size):
        alone = replace(sending, symbols=(symbol,), onset_s=0.0, messages=1)
        noise = alone.noise(grid_s)
        followed = [responses[axis].followed(noise[:, row], STEP_S) for row, axis in enumerate(sending.channel.axes)]
        moved.append(np.concatenate([np.zeros((len(followed), 1)), STEP_S * np.cumsum(followed, axis=1)], axis=1))
    return np.array(moved)


def _at(moved: Floats, since_s: Floats) -> Floats:
    """(M, axes, bins): displacement in each time bin between instants `since_s` after the window's start."""
    place = np.clip(since_s / STEP_S, 0.0, moved.shape[2] - 1)
    below = np.minimum(place.astype(np.int64), moved.shape[2] - 2)
    part = place - below
    at_edges = moved[:, :, below] * (1.0 - part) + moved[:, :, below + 1] * part
    return np.asarray(np.diff(at_edges, axis=2))
