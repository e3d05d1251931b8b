"""Robots that follow commands as no member of the auditor's family of plants does, for the tests of verdicts."""

import numpy as np

from mtm_onboard.runtime.modulator import Modulator
from tests.audit.moving_robot import observed

STEP_S = 0.01
BASE_MPS = np.array([0.25, 0.1])


def commands(key, name, symbols, seconds, onset_s):
    """Commanded velocities (n, 2) every hundredth of a second: a slow task and, from the onset on, the message."""
    times_s = np.arange(round(seconds / STEP_S) + 1) * STEP_S
    asked = BASE_MPS * np.stack([np.cos(0.4 * times_s), np.sin(0.3 * times_s)], axis=1)
    modulator, channel = Modulator(key.codebook(), name, symbols), key.scheme.channel(name)
    ticks = np.floor((times_s - onset_s) * key.scheme.rate_hz + 1e-6).astype(int)
    for row in np.flatnonzero(ticks >= 0):
        asked[row] += channel.sigma * np.asarray(modulator.perturbation(int(ticks[row])))[:2]
    return times_s, asked


def lagged(values, lag_s, delay_s=0.08):
    """A delay and a first-order lag."""
    late = np.concatenate([np.repeat(values[:1], round(delay_s / STEP_S), axis=0), values])[: len(values)]
    followed, now = np.empty_like(late), late[0].copy()
    for row, wanted in enumerate(late):
        now += (wanted - now) * STEP_S / lag_s
        followed[row] = now
    return followed


def saturating(asked, _times_s, _rng):
    """Motors whose speed is a hyperbolic tangent of what is asked, both axes together."""
    size = np.linalg.norm(asked, axis=1, keepdims=True)
    return lagged(0.22 * np.tanh(size / 0.22) * asked / np.maximum(size, 1e-9), 0.18)


def differential(asked, _times_s, _rng):
    """Two wheels: it goes only where it looks, and a command to the side turns it."""
    speeds = lagged(asked, 0.12)
    headings_rad = np.cumsum(1.5 * speeds[:, 1]) * STEP_S
    return speeds[:, :1] * np.stack([np.cos(headings_rad), np.sin(headings_rad)], axis=1)


def legged(asked, times_s, rng):
    """A gait that sways within the band, its pace wandering, and steps that follow what was asked at touchdown."""
    phase = 2.0 * np.pi * np.cumsum(1.9 + 0.15 * np.cumsum(rng.standard_normal(len(times_s))) * STEP_S) * STEP_S
    sway = 0.05 * np.stack([np.sin(2.0 * phase), np.sin(phase) + 0.4 * np.sin(3.0 * phase)], axis=1)
    held = asked[(np.floor(times_s / 0.12) * 0.12 / STEP_S).astype(int)]
    return lagged(held, 0.1) + sway


def strange_track(key, name, symbols, seconds, follow, seed, onset_s=0.4):
    """What motion capture sees of it."""
    times_s, asked = commands(key, name, symbols, seconds, onset_s)
    velocities = follow(asked, times_s, np.random.default_rng([seed, 7]))
    return observed(name, times_s, np.cumsum(velocities, axis=0) * STEP_S, 100.0, seed)
