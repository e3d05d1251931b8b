"""The modulator: the noise of one channel's message, looked up by tick number."""

import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.model.velocity import AXES, BodyVelocity
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.framing import channel_symbols
from mtm_onboard.runtime.message import Played, Silence

Floats = NDArray[np.float64]

_KEPT_WINDOWS = 2
# Between two windows that another thread computes, so that the loop's never waits longer than one takes.
_BREATH_S = 0.001


@dataclass(frozen=True, eq=False)
class _Part:
    """A message from `start_tick` up to `end_tick`, and the rows that its noise comes from, by tick modulo rows."""

    message: Played
    start_tick: int
    end_tick: float
    noise: Floats
    offsets: Floats


class Queued:
    """A message that waits to be taken up by the loop. `replaced` is then the one that waited for the same boundary."""

    def __init__(self, message: Played, noise: Floats, offsets: Floats) -> None:
        self.message = message
        self.replaced: Played | None = None
        self._noise = noise
        self._offsets = offsets
        self._start_tick = 0
        # Released once, by the loop: a release, unlike an event's, never waits for whoever is waiting.
        self._waiting = threading.Lock()
        self._waiting.acquire()

    def start_tick(self, timeout_s: float) -> int | None:
        """The tick that it is played from, a message boundary; None when no tick came within `timeout_s`."""
        if not self._waiting.acquire(timeout=timeout_s):
            return None
        self._waiting.release()
        return self._start_tick

    def _take(self, start_tick: int, end_tick: float, replaced: Played | None = None) -> _Part:
        self._start_tick, self.replaced = start_tick, replaced
        self._waiting.release()
        return _Part(self.message, start_tick, end_tick, self._noise, self._offsets)


class Modulator:
    """Plays a message from tick 0 on, again and again when `repeat` is set, until another is queued.

    `message` says the whole message's symbols of each slot, or is a sequence of this channel's own l_c symbols, or
    `SILENCE`, which has no noise. Tick 0 is the start of the codebook's first slot. Everything is a function of the
    tick number alone, so ticks that never come shift nothing. Under the fixed schedule a message is computed before it
    is played; under the rolling schedule the window being played and the next one are held, and `prepare` computes
    what comes after. Raises MtmError for an unknown channel, a wrong number of symbols or a symbol outside the
    alphabet.
    """

    def __init__(self, codebook: Codebook, channel_name: str, message: Played, *, repeat: bool = True) -> None:
        scheme = codebook.scheme
        self.channel = channel = scheme.channel(channel_name)
        self.message_ticks = scheme.message_ticks
        self._codebook = codebook
        self._window_ticks = scheme.window_ticks(channel)
        self._rolling = scheme.schedule == "rolling"
        self._repeat = repeat
        self._body_axes = [AXES.index(axis) for axis in channel.axes] if set(channel.axes) <= set(AXES) else None
        self._silence = np.zeros(len(channel.axes))
        self._silence.flags.writeable = False

        # Of the rolling schedule: the rows of the held windows, which these are, and the symbols of one slot.
        self._ring = self._rows(_KEPT_WINDOWS)
        self._held = [-1] * _KEPT_WINDOWS
        self._known: tuple[_Part | None, int, Sequence[int]] = (None, 0, ())

        self._tick = -1
        self._queue: deque[Queued] = deque()
        self._next: _Part | None = None
        self._part = self._queued(message)._take(0, self._end_tick(0, message))
        if self._rolling:
            for window in range(_KEPT_WINDOWS):
                if self.sends(window * self._window_ticks):
                    self._compute(window)

    @property
    def message(self) -> Played:
        """The message being played, or SILENCE."""
        return self._part.message

    @property
    def waiting(self) -> Played | None:
        """What takes its place at the next boundary."""
        part = self._next
        return None if part is None else part.message

    def queue(self, message: Played) -> Queued:
        """Play `message` from the next message boundary on; from any thread, and the loop waits for nothing.

        One that still waits for its boundary is replaced. Raises MtmError as the constructor does.
        """
        queued = self._queued(message, _BREATH_S)
        self._queue.append(queued)
        return queued

    def withdraw(self, queued: Queued) -> bool:
        """Take back what the loop has not taken up; false when it has."""
        try:
            self._queue.remove(queued)
        except ValueError:
            return False
        return True

    def sends(self, tick: int) -> bool:
        """True when a message has noise at this tick: from tick 0 on, and without repeat up to its last tick."""
        part = self._part_at(tick)
        return part.start_tick <= tick < part.end_tick

    def slot_played(self, tick: int) -> tuple[int, tuple[int, ...]] | None:
        """The message slot of this tick and this channel's own symbols in it; None where there is no noise."""
        if not self.sends(tick):
            return None
        slot = self._codebook.first_slot + tick // self.message_ticks
        return slot, tuple(self._own_symbols(self._part_at(tick).message, slot))

    def perturbation(self, tick: int) -> Floats:
        """Unit-variance noise of this tick, a read-only view of shape (axes,); zeros outside the message."""
        part = self._part_at(tick)
        return part.noise[self._row(part, tick)] if part.start_tick <= tick < part.end_tick else self._silence

    def substitute(self, tick: int, mean: Floats, sigma: Floats | float) -> Floats:
        """The action mean + sigma * eps of a Gaussian policy, with the keyed noise as its eps; shape (axes,)."""
        action: Floats = mean + sigma * self.perturbation(tick)
        return action

    def add(self, tick: int, base: BodyVelocity) -> BodyVelocity:
        """`base` with sigma * eps added on the channel's axes; raises MtmError as `require_body_axes` does."""
        part = self._part_at(tick)
        if not part.start_tick <= tick < part.end_tick:
            return base
        if self._body_axes is None:
            self.require_body_axes()
        vx_mps, vy_mps, wz_radps = base
        offset: list[float] = part.offsets[self._row(part, tick)].tolist()
        return BodyVelocity(vx_mps + offset[0], vy_mps + offset[1], wz_radps + offset[2])

    def require_body_axes(self) -> None:
        """Raise MtmError when the channel has an axis, such as a joint, that no body velocity has."""
        if self._body_axes is None:
            raise MtmError(
                f"channel {self.channel.name!r} has the axes {', '.join(self.channel.axes)}, but only "
                f"{', '.join(AXES)} can be added to a body velocity; choose a channel with those"
            )

    def prepare(self, tick: int) -> None:
        """Take up what was queued, and compute the window after `tick`'s unless it is held; after the send."""
        self._tick = tick
        if self._next is not None and tick >= self._next.start_tick:
            self._part, self._next = self._next, None
        if self._queue:
            self._take_up(tick)
        if self._rolling:
            following = max(0, tick // self._window_ticks + 1)
            if self._held[following % _KEPT_WINDOWS] != following and self.sends(following * self._window_ticks):
                self._compute(following)

    def _take_up(self, tick: int) -> None:
        start_tick = self._boundary(tick) * self.message_ticks
        try:
            while True:
                queued = self._queue.popleft()
                self._next = queued._take(start_tick, self._end_tick(start_tick, queued.message), self.waiting)
        except IndexError:
            # All are taken, or the one that was seen has been withdrawn.
            pass
        first = start_tick // self._window_ticks
        self._held = [-1 if window >= first else window for window in self._held]

    def _boundary(self, tick: int) -> int:
        """Number of the message that begins next after `tick`."""
        return max(0, tick // self.message_ticks + 1)

    def _queued(self, message: Played, breath_s: float = 0.0) -> Queued:
        """`message` with its noise, computed here under the fixed schedule; checks it under both."""
        symbols = self._own_symbols(message, self._codebook.first_slot + self._boundary(self._tick))
        if self._rolling:
            return Queued(message, *self._ring)
        noise, offsets = self._rows(len(symbols))
        for window, symbol in enumerate(symbols):
            self._fill(noise, offsets, window, window, symbol)
            if breath_s:
                time.sleep(breath_s)
        return Queued(message, noise, offsets)

    def _own_symbols(self, message: Played, slot: int) -> Sequence[int]:
        scheme, channel = self._codebook.scheme, self.channel
        if isinstance(message, Silence):
            return ()
        if not isinstance(message, Sequence):
            return channel_symbols(message.symbols(slot), scheme)[channel.name]
        if len(message) != channel.symbols:
            raise MtmError(
                f"channel {channel.name!r} sends {channel.symbols} symbols a message, not {len(message)}; "
                "give this channel's own part of the message"
            )
        for symbol in message:
            if not 0 <= symbol < scheme.alphabet_size:
                raise MtmError(f"symbol {symbol} is outside the alphabet; choose 0 to {scheme.alphabet_size - 1}")
        return message

    def _end_tick(self, start_tick: int, message: Played) -> float:
        if isinstance(message, Silence):
            return start_tick
        end_tick = np.inf if self._repeat else start_tick + self.message_ticks
        # Beyond the last slot that the key is for there is nothing to play.
        last = self._codebook.last_slot
        held = np.inf if last is None else (last - self._codebook.first_slot + 1) * self.message_ticks
        return max(float(start_tick), min(end_tick, held))

    def _part_at(self, tick: int) -> _Part:
        following = self._next
        return self._part if following is None or tick < following.start_tick else following

    def _row(self, part: _Part, tick: int) -> int:
        if self._rolling:
            window = tick // self._window_ticks
            # Only a jump over a whole window gets here unprepared; late noise would be wrong, this is only slow.
            if self._held[window % _KEPT_WINDOWS] != window:
                self._compute(window)
        return tick % len(part.noise)

    def _compute(self, window: int) -> None:
        later, place = divmod(window, self.channel.symbols)
        part = self._part_at(later * self.message_ticks)
        if (part, later) != self._known[:2]:
            self._known = (part, later, self._own_symbols(part.message, self._codebook.first_slot + later))
        held = window % _KEPT_WINDOWS
        self._fill(*self._ring, held, window, self._known[2][place])
        self._held[held] = window

    def _fill(self, noise: Floats, offsets: Floats, place: int, window: int, symbol: int) -> None:
        samples = self._codebook.samples(self.channel, window, [symbol])[0].T
        rows = slice(place * self._window_ticks, (place + 1) * self._window_ticks)
        noise.flags.writeable = True
        noise[rows] = samples
        noise.flags.writeable = False
        if self._body_axes is not None:
            offsets[rows, self._body_axes] = np.array(self.channel.sigmas) * samples

    def _rows(self, windows: int) -> tuple[Floats, Floats]:
        noise = np.zeros((windows * self._window_ticks, len(self.channel.axes)))
        noise.flags.writeable = False
        return noise, np.zeros((len(noise), len(AXES)))
