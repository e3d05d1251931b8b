"""Smoothing a track with a constant-velocity Kalman filter, as the paper does for Lunar Lander and Reacher."""

from dataclasses import replace

import numpy as np
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import KalmanFilter

from mtm_audit.model.track import Floats, Track


def kalman_smoothed(track: Track, process_noise: float = 6.0, measurement_noise: float = 0.8) -> Track:
    """The track's filtered positions where it is valid; gaps stay gaps.

    `process_noise` is the standard deviation of the acceleration in units per squared frame interval (the median
    one), `measurement_noise` that of a position, both the paper's. The paper names no time unit; per second, its
    numbers would remove everything above half a hertz, and with it the message.
    """
    seen = np.flatnonzero(track.valid)
    if len(seen) < 2:
        return track
    axes = len(track.axes)
    steps = np.diff(track.times_s[seen])
    steps = np.concatenate([[0.0], steps / np.median(steps)])
    kalman = KalmanFilter(dim_x=2 * axes, dim_z=axes)
    kalman.x = np.ravel(np.stack([track.positions[seen[0]], np.zeros(axes)], axis=1))[:, None]
    kalman.P = np.kron(np.eye(axes), np.diag([measurement_noise**2, 10 * process_noise**2]))
    kalman.H = np.kron(np.eye(axes), [[1.0, 0.0]])
    kalman.R = measurement_noise**2 * np.eye(axes)
    positions = np.full_like(track.positions, np.nan)
    models: dict[float, tuple[Floats, Floats]] = {}
    for row, step in zip(seen, np.round(steps, 6), strict=True):
        if step > 0:
            # Most steps are of one length, and building the matrices costs more than using them.
            if step not in models:
                noise = np.kron(np.eye(axes), Q_discrete_white_noise(2, dt=step, var=process_noise**2))
                models[step] = np.kron(np.eye(axes), [[1.0, step], [0.0, 1.0]]), noise
            transition, noise = models[step]
            kalman.predict(F=transition, Q=noise)
            kalman.update(track.positions[row])
        positions[row] = (kalman.H @ kalman.x)[:, 0]
    return replace(track, positions=positions)
