"""The clock's rate from how the windows' delays drift over the recording, once symbols and plant are known."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mtm_audit.detectors.matched.estimate import Estimate
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.noise import whitened
from mtm_audit.detectors.matched.windows import Window
from mtm_audit.timing import Timing

# A drift below this over the recording changes nothing.
_NEGLIGIBLE_S = 0.002
_LARGEST_S = 0.04


def refined_timing(
    found: Estimate, windows: Sequence[Window], motions: Sequence[Motion], timings: Sequence[Timing]
) -> list[Timing]:
    """Timings with rates corrected by the slope of the windows' delays; unchanged where the drift is negligible.

    Each window's delay against its expected signal is one Gauss-Newton step, weighted by its information.
    """
    return [
        _refined(
            found, [i for i, window in enumerate(windows) if window.observation == number], windows, motion, timing
        )
        for number, (motion, timing) in enumerate(zip(motions, timings, strict=True))
    ]


def _refined(
    found: Estimate, members: Sequence[int], windows: Sequence[Window], motion: Motion, timing: Timing
) -> Timing:
    if len(members) < 3:
        return timing
    delays_s, information, middles_s = np.array([_delay(found, index, windows[index], motion) for index in members]).T
    total = information.sum()
    if total <= 0.0:
        return timing
    centre_s = (information @ middles_s) / total
    spread = information @ (middles_s - centre_s) ** 2
    if spread <= 0.0:
        return timing
    slope = (information @ ((middles_s - centre_s) * delays_s)) / spread
    span_s = float(np.ptp(middles_s))
    if not _NEGLIGIBLE_S < abs(slope) * span_s < 2.0 * _LARGEST_S:
        return timing
    # A signal that comes ever later was played by a slower clock.
    stretch = 1.0 + slope
    return replace(timing, onset_s=centre_s + (timing.onset_s - centre_s) * stretch, rate_hz=timing.rate_hz / stretch)


def _delay(found: Estimate, index: int, window: Window, motion: Motion) -> tuple[float, float, float]:
    """Delay of a window's data against its expected signal in seconds, its information (1/s^2), and its middle."""
    signal, residual, noise = found.signals[index], found.residuals[window.observation], found.noise
    middle_s = float(motion.middles_s[window.first : window.last].mean())
    if signal.shape[1] <= noise.order + 1:
        return 0.0, 0.0, middle_s
    slope = -np.gradient(signal, motion.step_s, axis=1)
    scales = noise.scales[window.observation][:, None]
    weights = noise.weights[window.observation][:, window.first + noise.order : window.last]
    moved = whitened(slope, noise.filter) / scales
    left = whitened(residual[:, window.first : window.last], noise.filter) / scales
    information = float(np.sum(weights * moved**2))
    delay_s = float(np.sum(weights * moved * left)) / information if information > 0.0 else 0.0
    return float(np.clip(delay_s, -_LARGEST_S, _LARGEST_S)), information, middle_s
