"""Tracks of vehicles that send, without the onboard program: noise on the demand, then the plant, then a camera."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil.experiments.verdicts.vehicles import Vehicle
from hil.plants.velocity_responses import Floats
from mtm_audit.model.track import Track
from mtm_onboard.model.velocity import AXES
from mtm_onboard.protocol import Channel, Codebook

STEP_S = 0.01
_WARM_UP_S = 1.0
_NOISE_M = 0.0005


@dataclass(frozen=True, kw_only=True)
class Sending:
    """What a vehicle plays: the channel's `symbols`, `messages` times from `onset_s` of the recording on, at
    `sigma` times the unit waveform, with a clock that is `rate_scale` times as fast as the scheme says.
    """

    codebook: Codebook
    channel: Channel
    symbols: tuple[int, ...]
    onset_s: float
    messages: int
    sigma: float
    rate_scale: float = 1.0

    def noise(self, times_s: Floats) -> Floats:
        """What is added to the demand at each instant, (n, axes of the channel); each tick is held."""
        scheme = self.codebook.scheme
        length = scheme.window_ticks(self.channel)
        # A ten-thousandth of a tick of slack: instants are sums of decimal fractions.
        ticks = np.floor((times_s - self.onset_s) * scheme.rate_hz * self.rate_scale + 1e-4).astype(np.int64)
        windows, places = np.divmod(ticks, length)
        table = np.stack([self.codebook.samples(self.channel, 0, [symbol])[0].T for symbol in self.symbols])
        plays = (windows >= 0) & (windows < self.messages * len(self.symbols))
        played: Floats = np.where(plays[:, None], table[windows % len(self.symbols), places], 0.0)
        return self.sigma * played


def sent_track(
    name: str, vehicle: Vehicle, sendings: Sequence[Sending], seconds: float, draw: np.random.Generator
) -> Track:
    """Motion capture at 100 Hz of a vehicle that plays all of `sendings` at once; none of them for a silent one."""
    warm_up = round(_WARM_UP_S / STEP_S)
    times_s: Floats = np.arange(-warm_up, round(seconds / STEP_S) + 1, dtype=np.float64) * STEP_S
    task = vehicle.tasks[int(draw.integers(len(vehicle.tasks)))]
    demand = task(len(times_s), STEP_S, draw)
    columns = [AXES.index(axis) for axis in vehicle.axes]
    for sending in sendings:
        demand[:, columns] += sending.noise(times_s)
    positions = vehicle.drive(demand, STEP_S, draw)[warm_up:]
    seen = positions + _NOISE_M * draw.standard_normal(positions.shape)
    return Track(name, times_s[warm_up:], seen, np.ones(len(seen), dtype=np.bool_))
