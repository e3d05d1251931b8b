"""Desynchronisation: commands reach the motors late, by a delay that changes.

A slow warp swings the delay to and fro once in two symbols; its level is the largest delay. Skipped and repeated ticks
move it by a tick at random instants; the level is how many there are in a symbol's 120 ticks.

Of a warp the matched detector is also told each window's mean delay, and the line that its delay follows best: what a
detector would gain that found them itself.
"""

from collections.abc import Mapping

import numpy as np

from hil.experiments.attacks.attack import Attack
from hil.experiments.attacks.driving import CHANCE_PERCENT, SCHEME, TICKS, suppressed
from hil.experiments.runs.cells import Scalar
from hil.worlds.discovery import Tamper, Tick
from mtm_audit.model.track import Floats

WARP, SLIPS = "slow warp, largest delay in ticks", "skipped and repeated ticks in a symbol"
_LEVELS = {WARP: (0.0, 1.0, 2.0, 4.0, 8.0, 16.0), SLIPS: (0.0, 1.0, 2.0, 4.0, 8.0, 16.0)}
_PERIOD_TICKS = 2 * SCHEME.message_ticks
_MOST_TICKS = 20


def warp(largest_ticks: float, rollouts: int) -> Floats:
    """(ticks, rollouts): delays that swing between 0 and the largest."""
    phase = 2.0 * np.pi * np.arange(TICKS) / _PERIOD_TICKS
    return np.repeat(0.5 * largest_ticks * (1.0 - np.cos(phase))[:, None], rollouts, axis=1)


def slips(in_a_symbol: float, rollouts: int, draw: np.random.Generator) -> Floats:
    """(ticks, rollouts): delays that go up or down by one tick, as often either way, between 0 and 20."""
    steps = draw.choice([-1.0, 1.0], (TICKS, rollouts)) * (draw.random((TICKS, rollouts)) < in_a_symbol / 120.0)
    delays = np.zeros((TICKS, rollouts))
    for tick in range(1, TICKS):
        delays[tick] = np.clip(delays[tick - 1] + steps[tick], 0.0, _MOST_TICKS)
    return delays


def delayed(delays_ticks: Floats) -> Tamper:
    """Sends what was requested so many ticks ago (ticks, rollouts), between two of them their mean by distance."""
    sent: list[Floats] = []

    def at(number: int) -> Floats:
        return sent[max(number, 0)]

    def tamper(tick: Tick) -> Floats:
        sent.append(tick.requested_mps)
        wanted = tick.number - delays_ticks[tick.number]
        before = np.floor(wanted).astype(int)
        part = (wanted - before)[:, None]
        rows = range(len(wanted))
        earlier = np.stack([at(int(before[row]))[row] for row in rows])
        later = np.stack([at(min(int(before[row]) + 1, tick.number))[row] for row in rows])
        return np.asarray((1.0 - part) * earlier + part * later)

    return tamper


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    def make(count: int, draw: np.random.Generator) -> Tamper:
        return delayed(warp(level, count) if arm == WARP else slips(level, count, draw))

    return suppressed(make, rollouts, seed, told=delays_told(warp(level, 1)[:, 0]) if arm == WARP else None)


def delays_told(delays_ticks: Floats) -> dict[str, Floats]:
    """(windows, 2) each, delay at a window's beginning in seconds and its growth in seconds a second, of (ticks,)."""
    windows = delays_ticks.reshape(-1, SCHEME.message_ticks)
    lines = np.stack([np.polyfit(np.arange(SCHEME.message_ticks), own, 1)[::-1] for own in windows])
    means = np.stack([windows.mean(axis=1), np.zeros(len(windows))], axis=1)
    return {name: own / [SCHEME.rate_hz, 1.0] for name, own in (("mean delays", means), ("delays and drifts", lines))}


ATTACK = Attack(
    name="desynchronisation", level="ticks (see the legend)", counted="messages right", levels=_LEVELS,
    measure=_measure, chance_percent=CHANCE_PERCENT,
)  # fmt: skip
