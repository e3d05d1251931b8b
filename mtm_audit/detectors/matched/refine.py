"""The clock's rate from how the windows' delays drift over the recording, once symbols and plant are known."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mtm_audit.detectors.matched.estimate import Estimate
from mtm_audit.detectors.matched.hypotheses import log_clock_prior
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.noise import whitened
from mtm_audit.detectors.matched.windows import Window
from mtm_audit.model.timing import Timing

# A drift below this over the recording changes nothing.
_NEGLIGIBLE_S = 0.002
_LARGEST_S = 0.04
_PIECE_S = 2.0
_FEWEST_PIECES = 4
# Slopes that are weighed, in standard deviations from what was measured.
_DEVIATIONS = np.linspace(-5.0, 5.0, 201)


def refined_timing(
    found: Estimate,
    windows: Sequence[Window],
    motions: Sequence[Motion],
    timings: Sequence[Timing],
    clock_hz: float | None = None,
) -> list[Timing]:
    """Timings with rates corrected by the slope of the windows' delays; unchanged where the drift is negligible.

    The delays are those of pieces of the windows against their expected signals, weighted by their information. Where
    clocks that follow UTC say the rate it is `clock_hz`, which delays of a few windows do not disprove.
    """
    return [
        _refined(
            found,
            [i for i, window in enumerate(windows) if window.observation == number],
            windows,
            motion,
            timing,
            clock_hz,
        )
        for number, (motion, timing) in enumerate(zip(motions, timings, strict=True))
    ]


def _refined(
    found: Estimate,
    members: Sequence[int],
    windows: Sequence[Window],
    motion: Motion,
    timing: Timing,
    clock_hz: float | None,
) -> Timing:
    pieces = np.array([piece for index in members for piece in _delays(found, index, windows[index], motion)])
    if len(pieces) < _FEWEST_PIECES or pieces[:, 1].sum() <= 0.0:
        return timing
    delays_s, information, middles_s = pieces.T
    centre_s = (information @ middles_s) / information.sum()
    spread = information @ (middles_s - centre_s) ** 2
    if spread <= 0.0:
        return timing
    slope = (information @ ((middles_s - centre_s) * delays_s)) / spread
    if clock_hz is not None:
        slope = _by_clock(slope, 1.0 / np.sqrt(spread), timing.rate_hz, clock_hz)
    if not _NEGLIGIBLE_S < abs(slope) * float(np.ptp(middles_s)) < 2.0 * _LARGEST_S:
        return timing
    # A signal that comes ever later was played by a slower clock.
    stretch = float(1.0 + slope)
    onset_s = float(centre_s + (timing.onset_s - centre_s) * stretch)
    return replace(timing, onset_s=onset_s, rate_hz=timing.rate_hz / stretch)


def _by_clock(slope: float, deviation: float, rate_hz: float, clock_hz: float) -> float:
    """The likeliest slope at `rate_hz` where it was measured with a standard deviation and a clock says the rate."""
    slopes = np.append(slope + _DEVIATIONS * deviation, rate_hz / clock_hz - 1.0)
    likely = -0.5 * ((slopes - slope) / deviation) ** 2 + log_clock_prior(rate_hz / (1.0 + slopes), clock_hz)
    return float(slopes[np.argmax(likely)])


def _delays(found: Estimate, index: int, window: Window, motion: Motion) -> list[tuple[float, float, float]]:
    """For each piece of a window: delay of the data against the expected signal (s), its information (1/s^2), middle.

    One Gauss-Newton step each.
    """
    signal, residual, noise = found.signals[index], found.residuals[window.observation], found.noise
    if signal.shape[1] <= noise.order + 1:
        return []
    filters, scales = noise.filters[window.observation], noise.scales[window.observation][:, None]
    weights = noise.weights[window.observation][:, window.first + noise.order : window.last]
    moved = whitened(-np.gradient(signal, motion.step_s, axis=1), filters) / scales
    left = whitened(residual[:, window.first : window.last], filters) / scales
    middles_s = motion.middles_s[window.first + noise.order : window.last]
    pieces = []
    for chosen in np.array_split(np.arange(moved.shape[1]), max(1, round(moved.shape[1] * motion.step_s / _PIECE_S))):
        weighted = weights[:, chosen] * moved[:, chosen]
        information = float(np.sum(weighted * moved[:, chosen]))
        if information > 0.0:
            delay_s = float(np.clip(np.sum(weighted * left[:, chosen]) / information, -_LARGEST_S, _LARGEST_S))
            pieces.append((delay_s, information, float(middles_s[chosen].mean())))
    return pieces
