"""Causal prediction: somebody foretells the noise of this tick from the past, and subtracts it.

From the noise of past commands, which takes the policy and a tap on the commands; or from past motion, exact or as a
camera sees it, which takes neither. The level is by how many ticks the newest that is known is late. With a white
floor of the robot's own under the band, whose density is so many decibels below the band's, less can be foretold;
and so it is with a keyed floor: a spectrum of the scheme, which leaves the total power what it is.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hil.experiments.attacks.attack import FORETOLD, Attack
from hil.experiments.attacks.driving import (
    CHANCE_PERCENT,
    SCHEME,
    SIGMA_MPS,
    TICKS,
    TRACKER_ERROR_M,
    overheard,
    suppressed,
)
from hil.experiments.attacks.foretelling import fitted, lagged, share_foretold
from hil.experiments.runs.cells import Scalar
from hil.worlds.discovery import Tamper, Tick
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Scheme

COMMANDS, EXACT, FILMED = "from commands", "from exact motion", "from filmed motion"
FLOORED = {"from commands, white floor at -10 dB": -10.0, "from commands, white floor at -5 dB": -5.0}
KEYED_FLOORED = {"from commands, keyed floor at -10 dB": -10.0, "from commands, keyed floor at -5 dB": -5.0}
_LEVELS = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)
_MEMORY = 30
# Half of the distance of two tones of a window, and less.
_EDGE_HZ = 0.04


class Foreteller:
    """Subtracts what weights foretell of the noise from a series that is known up to some ticks ago.

    `weights` (memory,) count from the newest that is known. `known` gives the newest of the series (rollouts, 2) in
    each tick. What was there and what was foretold is kept, for R2.
    """

    def __init__(self, weights: Floats, latency: int, source: str, rollouts: int, draw: np.random.Generator) -> None:
        self._weights, self._latency, self._source, self._draw = weights, latency, source, draw
        self._past = np.zeros((len(weights) + latency + 1, rollouts, 2))
        self._before_m: Floats | None = None
        self.there: list[Floats] = []
        self.foretold: list[Floats] = []

    def __call__(self, tick: Tick) -> Floats:
        """What is left of the command."""
        noise = tick.requested_mps - tick.base_mps
        if self._source != COMMANDS:
            self._push(self._step_m(tick.positions_m))
        guess = np.tensordot(self._weights, self._past[self._latency : self._latency + len(self._weights)], axes=1)
        if self._source == COMMANDS:
            self._push(noise)
        self.there.append(noise)
        self.foretold.append(guess)
        left: Floats = tick.requested_mps - guess
        return left

    @property
    def share(self) -> float:
        """R2 of what was foretold."""
        return share_foretold(np.array(self.there), np.array(self.foretold))

    def _push(self, newest: Floats) -> None:
        self._past[1:] = self._past[:-1].copy()
        self._past[0] = newest

    def _step_m(self, positions_m: Floats) -> Floats:
        seen_m = positions_m
        if self._source == FILMED:
            seen_m = positions_m + TRACKER_ERROR_M * self._draw.standard_normal(positions_m.shape)
        step_m = np.zeros_like(seen_m) if self._before_m is None else seen_m - self._before_m
        self._before_m = seen_m
        return step_m


def learnt_weights(source: str, latency: int, floor_mps: float = 0.0, scheme: Scheme = SCHEME) -> Floats:
    """What foretells the noise of a tick best in rollouts that were overheard."""
    noise, exact_m, filmed_m = overheard(scheme)
    if floor_mps:
        noise = noise + floor_mps * np.random.default_rng(0).standard_normal(noise.shape)
    target = noise.transpose(0, 2, 1).reshape(-1, TICKS)
    if source == COMMANDS:
        series, first = target, 1 + latency
    else:
        positions_m = exact_m if source == EXACT else filmed_m
        series = np.diff(positions_m, axis=1, prepend=positions_m[:, :1]).transpose(0, 2, 1).reshape(-1, TICKS)
        first = latency
    features = lagged(series, range(first, first + _MEMORY))
    return fitted(features.reshape(-1, _MEMORY), target.ravel())


def floor_mps(below_band_db: float) -> float:
    """Standard deviation of white noise whose density is so far from the band's."""
    low_hz, high_hz = SCHEME.band_hz
    return float(SIGMA_MPS * np.sqrt(10.0 ** (below_band_db / 10.0) * 0.5 * SCHEME.rate_hz / (high_hz - low_hz)))


def floored_scheme(below_band_db: float) -> Scheme:
    """The scheme with its band all over what it can play, and a spectrum so many decibels fainter beside the band."""
    low_hz, high_hz = SCHEME.band_hz
    spectrum = (
        (low_hz - _EDGE_HZ, below_band_db), (low_hz, 0.0), (high_hz, 0.0), (high_hz + _EDGE_HZ, below_band_db),
    )  # fmt: skip
    return replace(SCHEME, band_hz=(_EDGE_HZ, 0.5 * SCHEME.rate_hz - _EDGE_HZ), spectrum=spectrum)


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    source, latency = (COMMANDS if arm in FLOORED or arm in KEYED_FLOORED else arm), round(level)
    floor = floor_mps(FLOORED[arm]) if arm in FLOORED else 0.0
    scheme = floored_scheme(KEYED_FLOORED[arm]) if arm in KEYED_FLOORED else SCHEME
    weights = learnt_weights(source, latency, floor, scheme)
    made: list[Foreteller] = []

    def make(count: int, draw: np.random.Generator) -> Tamper:
        made.append(Foreteller(weights, latency, source, count, draw))
        return made[0]

    def injected(noise: Floats, draw: np.random.Generator) -> Floats:
        return np.asarray(noise + floor * draw.standard_normal(noise.shape))

    return {**suppressed(make, rollouts, seed, injected if floor else None, scheme), FORETOLD: made[0].share}


ATTACK = Attack(
    name="prediction", level="latency, ticks of 0.1 s", counted="messages right",
    levels=dict.fromkeys((COMMANDS, EXACT, FILMED, *FLOORED, *KEYED_FLOORED), _LEVELS), measure=_measure,
    chance_percent=CHANCE_PERCENT,
)  # fmt: skip
