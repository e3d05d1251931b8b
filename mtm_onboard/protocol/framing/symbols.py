"""Between a plain number and the symbols on the channels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mtm_onboard.protocol.errors import MtmError

if TYPE_CHECKING:
    from mtm_onboard.protocol.scheme import Scheme


def payload_bits(scheme: Scheme) -> int:
    """Whole bits that the symbols of one message hold, frame or not: floor(log2(M ** L))."""
    count = int(scheme.alphabet_size**scheme.message_symbols)
    return count.bit_length() - 1


def symbols_of_number(number: int, scheme: Scheme) -> tuple[int, ...]:
    """The message's L symbols: `number` in base M, most significant first. Raises MtmError when it does not fit."""
    limit = 1 << payload_bits(scheme)
    if not 0 <= number < limit:
        raise MtmError(
            f"the message {number} does not fit: this scheme carries {payload_bits(scheme)} bits, 0 to {limit - 1}"
        )
    digits = []
    for _ in range(scheme.message_symbols):
        number, digit = divmod(number, scheme.alphabet_size)
        digits.append(digit)
    return tuple(reversed(digits))


def number_of_symbols(symbols: Sequence[int], scheme: Scheme) -> int | None:
    """The number that `symbols` spell, or None when no message of this scheme is written so."""
    number = 0
    for symbol in symbols:
        number = number * scheme.alphabet_size + symbol
    return number if number < 1 << payload_bits(scheme) else None


def check_symbols(symbols: Sequence[int], scheme: Scheme) -> tuple[int, ...]:
    """The symbols themselves when there are L of them and all are in the alphabet; raises MtmError otherwise."""
    if len(symbols) != scheme.message_symbols:
        raise MtmError(f"{len(symbols)} symbols given, but a message of this scheme has {scheme.message_symbols}")
    for symbol in symbols:
        if not 0 <= symbol < scheme.alphabet_size:
            raise MtmError(f"symbol {symbol} is outside the alphabet; choose 0 to {scheme.alphabet_size - 1}")
    return tuple(symbols)


def channel_symbols(symbols: Sequence[int], scheme: Scheme) -> dict[str, tuple[int, ...]]:
    """Each channel's own symbols, in the order in which it plays them (split: consecutive parts; same: all)."""
    message = check_symbols(symbols, scheme)
    starts = {channel.name: scheme.first_position(channel) for channel in scheme.channels}
    return {channel.name: message[starts[channel.name] :][: channel.symbols] for channel in scheme.channels}
