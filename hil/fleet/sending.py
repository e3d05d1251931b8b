"""What a robot plays, without the onboard program: the noise that is added to its demand at any instant."""

from dataclasses import dataclass

import numpy as np

from hil.plants.responses import Floats
from mtm_onboard.protocol import Channel, Codebook

STEP_S = 0.01


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
