"""What vehicles without a target drive: velocities over a whole run, drawn at random, with nothing fed back.

All functions return body velocities (n, 3): vx, vy in m/s, wz in rad/s; the heading is zero before.
"""

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Floats = NDArray[np.float64]

_SPEED_MPS = 0.5


def zigzag(count: int, step_s: float, draw: np.random.Generator) -> Floats:
    """Straight legs of one to four seconds at one speed."""
    angles = _held(count, step_s, (1.0, 4.0), draw, lambda: draw.uniform(0.0, 2.0 * np.pi))
    return _level(_SPEED_MPS * np.stack([np.cos(angles), np.sin(angles)], axis=1))


def wander(count: int, step_s: float, draw: np.random.Generator) -> Floats:
    """A smooth random course below the band of the noise."""
    return _smooth(count, step_s, 0.3, draw)


def cruise(count: int, step_s: float, draw: np.random.Generator) -> Floats:
    """A smooth random course that a heavy vehicle can follow: its accelerations are about 0.2 m/s2."""
    return _smooth(count, step_s, 0.1, draw)


def _smooth(count: int, step_s: float, below_hz: float, draw: np.random.Generator) -> Floats:
    sections = signal.butter(2, below_hz, fs=1.0 / step_s, output="sos")
    before = round(3.0 / (below_hz * step_s))
    course = signal.sosfilt(sections, draw.standard_normal((before + count, 2)), axis=0)[before:]
    # The standard deviation of such noise in the long run, whatever this piece has.
    impulse = signal.sosfilt(sections, np.eye(1, round(20.0 / (below_hz * step_s)))[0])
    return _level(0.35 * course / np.sqrt(np.sum(impulse**2)))


def stop_and_go(count: int, step_s: float, draw: np.random.Generator) -> Floats:
    """Straight legs, and as many waits between them."""
    moving = _held(count, step_s, (0.5, 2.5), draw, itertools.cycle((0.0, 1.0)).__next__)
    return zigzag(count, step_s, draw) * moving[:, None]


def steering(count: int, step_s: float, draw: np.random.Generator) -> Floats:
    """Ahead at a speed that changes now and then, with a turn rate that does as well; never sideways."""
    speed_mps = _held(count, step_s, (2.0, 5.0), draw, lambda: draw.uniform(0.2, 0.6))
    turn_radps = _held(count, step_s, (1.0, 3.0), draw, lambda: draw.uniform(-0.8, 0.8))
    return np.stack([speed_mps, np.zeros(count), turn_radps], axis=1)


def spinning(count: int, step_s: float, draw: np.random.Generator) -> Floats:
    """A smooth course while the body turns at 1 rad/s, so that its axes sweep through the world."""
    course = wander(count, step_s, draw)
    # The heading in the middle of each step, which is what moves the body.
    angle = (np.arange(count) + 0.5) * step_s
    cosine, sine = np.cos(angle), np.sin(angle)
    ahead = cosine * course[:, 0] + sine * course[:, 1]
    left = cosine * course[:, 1] - sine * course[:, 0]
    return np.stack([ahead, left, np.ones(count)], axis=1)


def pick_and_place(count: int, step_s: float, draw: np.random.Generator) -> Floats:
    """A tool's smooth moves of one to two seconds (least jerk) between places of a square of 0.3 m, with rests."""
    path: list[Floats] = [np.zeros((1, 2))]
    while sum(map(len, path)) <= count:
        start, goal = path[-1][-1], draw.uniform(-0.15, 0.15, 2)
        steps = round(draw.uniform(1.0, 2.0) / step_s)
        part = np.arange(1, steps + 1)[:, None] / steps
        path.append(start + (goal - start) * (10.0 * part**3 - 15.0 * part**4 + 6.0 * part**5))
        path.append(np.repeat(goal[None, :], round(draw.uniform(0.1, 0.6) / step_s), axis=0))
    return _level(np.diff(np.concatenate(path)[: count + 1], axis=0) / step_s)


def _held(
    count: int, step_s: float, span_s: tuple[float, float], draw: np.random.Generator, value: Callable[[], float]
) -> Floats:
    """Values (n,), each held for a time drawn from `span_s`."""
    result: list[float] = []
    while len(result) < count:
        result += [float(value())] * round(draw.uniform(*span_s) / step_s)
    return np.array(result[:count])


def _level(course_mps: Floats) -> Floats:
    return np.concatenate([course_mps, np.zeros((len(course_mps), 1))], axis=1)
