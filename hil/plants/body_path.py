"""From body velocities to a path, and what the ground adds to them, over a whole run at once."""

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Floats = NDArray[np.float64]


def path_xy_m(velocities_body: Floats, step_s: float) -> Floats:
    """Positions (n, 2) in the world frame after each step, from vx, vy (m/s) and wz (rad/s) of the body, (n, 3).

    The heading is zero before the first step; the midpoint heading makes a step exact to second order in the turn.
    """
    turned = np.cumsum(velocities_body[:, 2]) * step_s
    middle = turned - 0.5 * step_s * velocities_body[:, 2]
    cosine, sine = np.cos(middle), np.sin(middle)
    ahead, left = velocities_body[:, 0], velocities_body[:, 1]
    world = np.stack([cosine * ahead - sine * left, sine * ahead + cosine * left], axis=1)
    return np.asarray(np.cumsum(world, axis=0) * step_s)


def slip(
    shape: tuple[int, int], step_s: float, deviation: float, correlation_s: float, draw: np.random.Generator
) -> Floats:
    """Velocity noise (n, axes) of that standard deviation whose correlation falls exponentially, stationary."""
    keep = np.exp(-step_s / correlation_s)
    kicks = deviation * np.sqrt(1.0 - keep**2) * draw.standard_normal(shape)
    kicks[0] /= np.sqrt(1.0 - keep**2)
    return np.asarray(signal.lfilter([1.0], [1.0, -keep], kicks, axis=0))


def gait(count: int, step_s: float, stride_hz: float, speed_mps: float, draw: np.random.Generator) -> Floats:
    """Body sway (n, 3) of a walking robot: the stride and its second harmonic, whose pace and strength wander."""
    pace = stride_hz * (1.0 + slip((count, 1), step_s, 0.03, 1.0, draw)[:, 0])
    phase = 2.0 * np.pi * np.cumsum(pace) * step_s + draw.uniform(0.0, 2.0 * np.pi)
    strength = 1.0 + slip((count, 3), step_s, 0.15, 1.0, draw)
    offsets = draw.uniform(0.0, 2.0 * np.pi, 3)
    sway = np.stack([
        np.cos(2.0 * phase + offsets[0]),
        np.cos(phase + offsets[1]) + 0.3 * np.cos(3.0 * phase),
        0.5 * np.cos(phase + offsets[2]),
    ], axis=1)  # fmt: skip
    return np.asarray(speed_mps * strength * sway)
