"""From the windows of all channels to framed messages: repeats are added up, and each frame is decoded.

Every repetition of a message counts, whole or cut off. Where the message changed on the way, the recording falls into
parts that are decoded one by one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, islice

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax

from mtm_audit.decoding.message import Message, decode_message
from mtm_audit.detectors.base import ChannelReading
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Channel, Scheme
from mtm_onboard.protocol.framing import frame_order
from mtm_onboard.protocol.framing.slot_mask import slot_mask
from mtm_onboard.protocol.holding import Holding, Secret, holding_of
from mtm_onboard.protocol.slots import epoch_of_slot

Integers = NDArray[np.int64]

# What a slot's windows must say for a message to be counted as sent in it: odds of 20.
_SAYS_NATS = 3.0
# Ways to cut a recording in two that are tried at most; each costs a share of false acceptances.
_MOST_CUTS = 32


@dataclass(frozen=True)
class Delivered:
    """A message, the slots (first, last) whose windows say it, and when in the recording those begin and end.

    `ratios` (L, M) is what the message was decoded from, in frame order.
    """

    message: Message
    slots: tuple[int, int]
    start_s: float
    end_s: float
    ratios: Floats


@dataclass(frozen=True)
class Heard:
    """One channel and its reading."""

    channel: Channel
    result: ChannelReading


def decode_frames(
    heard: Sequence[Heard], scheme: Scheme, secret: Secret, first_slot: int, *, order_known: bool
) -> tuple[Delivered, ...]:
    """The messages in the order in which they were sent; without any that holds, the best guess alone.

    `heard` are the channels that could be read. When the order is not known, which window is the first of a message is
    tried as well, and only a check can tell. The `tried` of each message counts all that was tried for it.
    """
    checked = scheme.framing is not None and scheme.framing.check != "none"
    turns = range(_turns(scheme) if checked and not order_known else 1)
    holding = holding_of(secret)
    sights = [_Sight(heard, scheme, holding, first_slot, turn) for turn in turns]
    wholes = [[sight.decoded(part) for part in sight.parts(sight.seen)] for sight in sights]
    tried = sum(item.message.tried for found in wholes for item in found)
    best = max(wholes, key=_worth)
    if checked and not _whole(best):
        for sight, place in islice(_cuts(sights), _MOST_CUTS):
            parts = [*sight.parts(sight.seen[:place]), *sight.parts(sight.seen[place:])]
            found = [sight.decoded(part) for part in parts]
            tried += sum(item.message.tried for item in found)
            best = max(best, found, key=_worth)
    delivered = _holding(best) or best[:1]
    return tuple(replace(item, message=replace(item.message, tried=tried)) for item in delivered)


class _Sight:
    """All windows seen, put into slots and frame order, the message turned by `turn` windows."""

    def __init__(self, heard: Sequence[Heard], scheme: Scheme, holding: Holding, first_slot: int, turn: int) -> None:
        self._scheme = scheme
        self._holding = holding
        self._ratios: dict[int, Floats] = {}
        self._spans_s: dict[int, tuple[float, float]] = {}
        self._masks: dict[int, Integers | None] = {}
        for item in heard:
            first = scheme.first_position(item.channel)
            window_s = scheme.window_ticks(item.channel) / item.result.reading.timing.rate_hz
            numbers = _numbers(item, heard[0], scheme, window_s) + turn
            slots, places = np.divmod(numbers, item.channel.symbols)
            for slot in np.unique(slots):
                mine = slots == slot
                self._add(first_slot + int(slot), first + places[mine], item.result.window_ratios[mine])
                starts_s = item.result.reading.window_starts_s[mine]
                self._span(first_slot + int(slot), float(starts_s.min()), float(starts_s.max()) + window_s)
        self.seen = sorted(self._ratios)

    def parts(self, slots: Sequence[int]) -> list[list[int]]:
        """The slots by epoch, since a check holds in one alone."""
        return [list(group) for _, group in groupby(slots, key=self._epoch)]

    def decoded(self, part: Sequence[int]) -> Delivered:
        """What slots of one epoch say together."""
        ratios: Floats = np.sum([self._ratios[slot] for slot in part], axis=0)
        epoch = self._epoch(part[0])
        message = decode_message(ratios, self._scheme, self._holding.tag_key(epoch), [epoch])
        saying = [slot for slot in part if _says(self._ratios[slot], np.argmax(ratios, axis=1))] or list(part)
        start_s = min(self._spans_s[slot][0] for slot in saying)
        end_s = max(self._spans_s[slot][1] for slot in saying)
        return Delivered(message, (saying[0], saying[-1]), start_s, end_s, ratios)

    def _epoch(self, slot: int) -> int:
        return self._scheme.epoch if self._scheme.schedule == "fixed" else epoch_of_slot(slot, self._scheme)[0]

    def _add(self, slot: int, positions: Integers, ratios: Floats) -> None:
        shape = (self._scheme.message_symbols, self._scheme.alphabet_size)
        table = self._ratios.setdefault(slot, np.zeros(shape))
        places, mask = frame_order(self._scheme, slot)[positions], self._mask(slot)
        if mask is not None:
            # Symbol j without the mask was sent as j ^ mask.
            sent = np.arange(shape[1]) ^ mask[places][:, None]
            ratios = np.take_along_axis(ratios, sent, axis=1)
        table[places] += ratios

    def _mask(self, slot: int) -> Integers | None:
        if slot not in self._masks:
            self._masks[slot] = slot_mask(self._scheme, self._holding, slot)
        return self._masks[slot]

    def _span(self, slot: int, start_s: float, end_s: float) -> None:
        known = self._spans_s.get(slot, (start_s, end_s))
        self._spans_s[slot] = (min(start_s, known[0]), max(end_s, known[1]))


def _says(ratios: Floats, symbols: Integers) -> bool:
    """Whether windows (L, M) of one slot speak for these symbols: those before the message's first slot do not.

    What a neighbour's delay leaves of a window lies around 0.
    """
    # Log posteriors against those of chance, so that what was not seen counts nothing.
    gains = log_softmax(ratios, axis=1) + np.log(ratios.shape[1])
    return float(gains[np.arange(len(symbols)), symbols].sum()) > _SAYS_NATS


def _cuts(sights: Sequence[_Sight]) -> Iterator[tuple[_Sight, int]]:
    """Where a recording may be cut in two, from its middle outwards."""
    for sight in sights:
        count = len(sight.seen)
        yield from ((sight, place) for place in sorted(range(1, count), key=lambda place: abs(2 * place - count)))


def _holding(found: Sequence[Delivered]) -> list[Delivered]:
    return [item for item in found if item.message.check_passed]


def _whole(found: Sequence[Delivered]) -> bool:
    """Whether every part holds and is the likeliest frame; a mixture of two messages may hold, but is not."""
    return all(item.message.check_passed and item.message.log_odds_nats > 0.0 for item in found)


def _worth(found: Sequence[Delivered]) -> tuple[int, float]:
    """More messages that hold are better, and then likelier ones."""
    return len(_holding(found)), sum(item.message.log_odds_nats for item in found)


def _turns(scheme: Scheme) -> int:
    """In how many ways a message may be turned; one where channels differ in their windows."""
    counts = {channel.symbols for channel in scheme.channels}
    return counts.pop() if len(counts) == 1 else 1


def _numbers(item: Heard, first: Heard, scheme: Scheme, window_s: float) -> Integers:
    """Window numbers counted alike on all channels, which found their onsets each by itself."""
    reading = item.result.reading
    if scheme.schedule == "rolling" or item.channel.symbols != first.channel.symbols:
        return reading.window_numbers
    return reading.window_numbers + round((reading.timing.onset_s - first.result.reading.timing.onset_s) / window_s)
