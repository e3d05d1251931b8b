"""Messages, as the modulator plays them: the symbols of each slot."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.protocol.framing import Payload, check_symbols, encode_frame, frame_order, symbols_of_number
from mtm_onboard.protocol.framing.slot_mask import slot_mask
from mtm_onboard.protocol.slots import epoch_of_slot

# What an operator may ask a robot to send; a tuple is the whole message's symbols, of a scheme without framing.
Content = Payload | tuple[int, ...]


class Message(Protocol):
    """What a robot sends from one slot to the next."""

    @property
    def number(self) -> int:
        """Counts the messages of a run; carried in the frame when the scheme says so."""
        ...

    @property
    def words(self) -> str:
        """What it says, for people, such as "number 178"."""
        ...

    def symbols(self, slot: int) -> tuple[int, ...]:
        """The whole message's L symbols in the order in which `slot` plays them. May be called from any thread."""
        ...


class Silence:
    """Played in the place of a message: no noise at all."""


SILENCE = Silence()
"""No message: the modulator plays no noise."""

# What a modulator plays; a sequence is one channel's own symbols of every slot.
Played = Message | Sequence[int] | Silence


@dataclass(frozen=True)
class PlainMessage:
    """The same symbols in every slot; `content` is what they spell, None when they stand for themselves."""

    played: tuple[int, ...]
    number: int = 0
    content: int | None = None

    @property
    def words(self) -> str:
        """The number, or the symbols themselves."""
        return words_of(self.played if self.content is None else self.content)

    def symbols(self, slot: int) -> tuple[int, ...]:
        """All L of them."""
        return self.played


class FramedMessage:
    """A payload in a frame whose check is of the slot's epoch, in the order of the slot.

    Raises MtmError when the payload is not one that the key's scheme carries.
    """

    def __init__(self, payload: Payload, key: Key, number: int = 0) -> None:
        self.payload = payload
        self.number = number
        self._key = key
        # What does not fit is found here, by a tag of whatever epoch the key is for.
        grant, scheme = key.holding.grant, key.scheme
        self._encoded = self._encode(scheme.epoch if grant is None else grant.epochs(scheme)[0])

    @property
    def words(self) -> str:
        """The payload."""
        return words_of(self.payload)

    def symbols(self, slot: int) -> tuple[int, ...]:
        """Permuted as the slot has it; encoded anew when the epoch is another than last time."""
        scheme = self._key.scheme
        epoch = scheme.epoch if scheme.schedule == "fixed" else epoch_of_slot(slot, scheme)[0]
        encoded_for, frame = self._encoded
        if epoch != encoded_for:
            self._encoded = _, frame = self._encode(epoch)
        mask = slot_mask(scheme, self._key.holding, slot)
        if mask is not None:
            frame = tuple((np.array(frame) ^ mask).tolist())
        return tuple(frame[place] for place in frame_order(scheme, slot).tolist())

    def _encode(self, epoch: int) -> tuple[int, tuple[int, ...]]:
        key = self._key
        secret = key.holding.tag_key(epoch)
        return epoch, encode_frame(self.payload, key.scheme, secret, number=self.number, epoch=epoch)


def message_of(content: Content, key: Key, number: int = 0) -> Message:
    """The message with that content; raises MtmError when the key's scheme does not carry it."""
    scheme = key.scheme
    if isinstance(content, tuple):
        if scheme.framing is not None:
            raise MtmError("this key's scheme frames its messages, so symbols cannot be given; give the payload")
        return PlainMessage(check_symbols(content, scheme), number)
    if scheme.framing is not None:
        return FramedMessage(content, key, number)
    if isinstance(content, bool) or not isinstance(content, int):
        raise MtmError(
            "this key's scheme carries plain numbers and no text or bytes; give a number, or make a key with "
            "mtm-onboard keygen --payload"
        )
    return PlainMessage(symbols_of_number(content, scheme), number, content)


def words_of(content: Content) -> str:
    """The content for people: number 178, text 'gate 4', bytes 6869, symbols 3,1,0,2."""
    if isinstance(content, tuple):
        return f"symbols {','.join(map(str, content))}"
    if isinstance(content, bytes):
        return f"bytes {content.hex()}"
    return f"text {content!r}" if isinstance(content, str) else f"number {content}"


def content_from_table(table: dict[str, Any]) -> Content:
    """The content in a table with one field: number, text, hex (bytes) or symbols; raises MtmError for any other."""
    if len(table) != 1:
        raise MtmError("give exactly one content: a number, text, hex or symbols")
    ((kind, value),) = table.items()
    if kind == "number" and isinstance(value, int) and not isinstance(value, bool):
        return value
    if kind == "text" and isinstance(value, str):
        return value
    if kind == "hex" and isinstance(value, str):
        try:
            return bytes.fromhex(value)
        except ValueError as error:
            raise MtmError(f"{value!r} is not bytes; give two hexadecimal digits for each byte") from error
    if kind == "symbols" and isinstance(value, list | tuple) and all(type(symbol) is int for symbol in value):
        return tuple(value)
    raise MtmError(f"the content {kind} cannot be {value!r}; give a number, text, hex or symbols")
