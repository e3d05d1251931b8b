"""Which symbol a track's motion carries at an instant of the film."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.decoding.decoding import ChannelDecoding, Decoding
from mtm_audit.model.track import Floats


@dataclass(frozen=True)
class Passing:
    """A window that is passing: the `channel` whose it is, its `symbol` as text, and which part is over, 0 to 1."""

    channel: str
    symbol: str
    passed: float


@dataclass(frozen=True, eq=False)
class Windows:
    """The windows of one channel in the film's own time: `starts_s` (n,), all `length_s` long, and their `symbols`."""

    body: str
    track: str
    channel: str
    starts_s: Floats
    length_s: float
    symbols: tuple[str, ...]

    def passing(self, time_s: float) -> Passing | None:
        """The window at that instant; None between windows, before the first and after the last."""
        inside = np.flatnonzero((self.starts_s <= time_s) & (time_s < self.starts_s + self.length_s))
        if not len(inside):
            return None
        window = int(inside[-1])
        passed = (time_s - float(self.starts_s[window])) / self.length_s
        return Passing(self.channel, self.symbols[window], passed)


def windows_of(decoding: Decoding, begin_s: float, speed: float) -> tuple[Windows, ...]:
    """The windows of all channels that were read; none of a recording without a message, where they would be chance.

    The recording was played `speed` times as fast from the instant `begin_s` of the film on.
    """
    if decoding.verdict == "absent":
        return ()
    return tuple(
        _windows(channel, decoding, begin_s, speed) for channel in decoding.channels if channel.state == "read"
    )


def tracks_by_body(decoding: Decoding) -> dict[str, str]:
    """The name of the track that shows each body, by the body's name; empty without a message.

    Which track shows which body is then chance.
    """
    if decoding.verdict == "absent":
        return {}
    return {channel.channel.body: channel.glimpse.name for channel in decoding.channels if channel.glimpse is not None}


def _windows(channel: ChannelDecoding, decoding: Decoding, begin_s: float, speed: float) -> Windows:
    reading, glimpse = channel.reading, channel.glimpse
    assert reading is not None
    assert glimpse is not None
    length_s = decoding.scheme.window_ticks(channel.channel) / reading.timing.rate_hz
    return Windows(
        body=channel.channel.body,
        track=glimpse.name,
        channel=channel.channel.name,
        starts_s=begin_s + (reading.window_starts_s - begin_s) * speed,
        length_s=length_s * speed,
        symbols=_symbols(channel, decoding, reading.window_positions, reading.window_scores),
    )


def _symbols(
    channel: ChannelDecoding, decoding: Decoding, positions: Sequence[int] | np.ndarray, scores: Floats
) -> tuple[str, ...]:
    """The symbol of each window, with a question mark where it is not certain.

    A message of numbers repeats its symbols. A frame's windows differ, so each shows what it says by itself.
    """
    if decoding.scheme.framing is not None:
        doubt = "" if decoding.verdict == "decoded" else " ?"
        return tuple(f"{int(best)}{doubt}" for best in np.argmax(scores, axis=1))
    first = decoding.scheme.first_position(channel.channel)
    return tuple(_placed(decoding, first + int(position)) for position in positions)


def _placed(decoding: Decoding, place: int) -> str:
    symbol = decoding.symbols[place]
    return "?" if symbol is None else f"{symbol}{' ?' if place in decoding.uncertain else ''}"
