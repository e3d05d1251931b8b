"""The modulator: the noise of one channel's message, looked up by tick number."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.motion import AXES, BodyVelocity
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError

Floats = NDArray[np.float64]

_KEPT_WINDOWS = 2


class Modulator:
    """Plays `symbols` (this channel's own, l_c of them) from tick 0 on, again and again when `repeat` is set.

    Everything is a function of the tick number alone, so ticks that never come shift nothing. Under the fixed
    schedule the whole message is computed here; under the rolling schedule the window being played and the next
    one are held, and `prepare` computes what comes after. Raises MtmError for an unknown channel, a wrong number
    of symbols or a symbol outside the alphabet.
    """

    def __init__(self, codebook: Codebook, channel_name: str, symbols: Sequence[int], *, repeat: bool = True) -> None:
        scheme = codebook.scheme
        self.channel = channel = scheme.channel(channel_name)
        if len(symbols) != channel.symbols:
            raise MtmError(
                f"channel {channel_name!r} sends {channel.symbols} symbols a message, not {len(symbols)}; "
                "give this channel's own part of the message"
            )
        for symbol in symbols:
            if not 0 <= symbol < scheme.alphabet_size:
                raise MtmError(f"symbol {symbol} is outside the alphabet; choose 0 to {scheme.alphabet_size - 1}")
        self.symbols = tuple(symbols)
        self.message_ticks = scheme.message_ticks
        self._codebook = codebook
        self._window_ticks = scheme.window_ticks(channel)
        self._rolling = scheme.schedule == "rolling"
        self._end_tick: float = np.inf if repeat else scheme.message_ticks
        self._body_axes = [AXES.index(axis) for axis in channel.axes] if set(channel.axes) <= set(AXES) else None

        windows = _KEPT_WINDOWS if self._rolling else channel.symbols
        self._rows = windows * self._window_ticks
        self._noise = np.zeros((self._rows, len(channel.axes)))
        self._offsets = np.zeros((self._rows, len(AXES)))
        self._silence = np.zeros(len(channel.axes))
        self._noise.flags.writeable = self._silence.flags.writeable = False
        self._held = [-1] * windows
        for window in range(windows):
            self._compute(window)

    def sends(self, tick: int) -> bool:
        """True when the message has noise at this tick: from tick 0 on, and without repeat up to its last tick."""
        return 0 <= tick < self._end_tick

    def perturbation(self, tick: int) -> Floats:
        """Unit-variance noise of this tick, a read-only view of shape (axes,); zeros outside the message."""
        return self._noise[self._row(tick)] if 0 <= tick < self._end_tick else self._silence

    def substitute(self, tick: int, mean: Floats, sigma: Floats | float) -> Floats:
        """The action mean + sigma * eps of a Gaussian policy, with the keyed noise as its eps; shape (axes,)."""
        action: Floats = mean + sigma * self.perturbation(tick)
        return action

    def add(self, tick: int, base: BodyVelocity) -> BodyVelocity:
        """`base` with sigma * eps added on the channel's axes; raises MtmError as `require_body_axes` does."""
        if not 0 <= tick < self._end_tick:
            return base
        if self._body_axes is None:
            self.require_body_axes()
        vx_mps, vy_mps, wz_radps = base
        offset: list[float] = self._offsets[self._row(tick)].tolist()
        return BodyVelocity(vx_mps + offset[0], vy_mps + offset[1], wz_radps + offset[2])

    def require_body_axes(self) -> None:
        """Raise MtmError when the channel has an axis, such as a joint, that no body velocity has."""
        if self._body_axes is None:
            raise MtmError(
                f"channel {self.channel.name!r} has the axes {', '.join(self.channel.axes)}, but only "
                f"{', '.join(AXES)} can be added to a body velocity; choose a channel with those"
            )

    def prepare(self, tick: int) -> None:
        """Compute the window after the one that `tick` is in, unless it is held; called after the send."""
        if self._rolling and 0 <= tick < self._end_tick:
            following = tick // self._window_ticks + 1
            if self._held[following % _KEPT_WINDOWS] != following:
                self._compute(following)

    def _row(self, tick: int) -> int:
        if self._rolling:
            window = tick // self._window_ticks
            # Only a jump over a whole window gets here unprepared; late noise would be wrong, this is only slow.
            if self._held[window % _KEPT_WINDOWS] != window:
                self._compute(window)
        return tick % self._rows

    def _compute(self, window: int) -> None:
        symbol = self.symbols[window % len(self.symbols)]
        samples = self._codebook.samples(self.channel, window, [symbol])[0].T
        slot = window % len(self._held)
        rows = slice(slot * self._window_ticks, (slot + 1) * self._window_ticks)
        self._noise.flags.writeable = True
        self._noise[rows] = samples
        self._noise.flags.writeable = False
        if self._body_axes is not None:
            self._offsets[rows, self._body_axes] = self.channel.sigma * samples
        self._held[slot] = window
