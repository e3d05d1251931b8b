"""From a frame's data bits to the symbols of a message and back, through a Reed-Solomon code where there is one."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.framing.framing import Layout
from mtm_onboard.protocol.framing.galois import PRIMITIVE_POLYNOMIALS, parity_of
from mtm_onboard.protocol.installing import install_command

if TYPE_CHECKING:
    from reedsolo import RSCodec

# The library keeps the field's tables in variables of its module.
_LIBRARY = threading.Lock()


def encode_symbols(data: Sequence[int], layout: Layout) -> list[tuple[int, ...]]:
    """The channel symbols (L each) of every one of `data`, numbers of `data_bits` bits, most significant bit first.

    Zero bits fill the last data symbol, parity follows (systematic, see `galois`), and zero symbols fill the message.
    """
    return [_channel_symbols(_codeword(_digits(value, layout), layout), layout) for value in data]


def decode_symbols(symbols: Sequence[int | None], layout: Layout) -> int:
    """The data of L channel symbols, None where one was not seen, with as many corrected as half the parity can.

    A missing symbol costs half of what a wrong one does. Raises MtmError when there are too many of either or the
    symbols belong to no codeword.
    """
    words = [
        _code_symbol(symbols[first : first + layout.group], layout)
        for first in range(0, layout.code_symbols * layout.group, layout.group)
    ]
    missing = [place for place, word in enumerate(words) if word is None]
    received = [0 if word is None else word for word in words]
    if layout.parity:
        received = _corrected(received, missing, layout)
    elif missing:
        raise MtmError(
            f"{len(missing)} symbols were not seen and the frame has no code to fill them; record for longer"
        )
    data = 0
    for word in received[: layout.data_symbols]:
        data = data << layout.field_bits | word
    padding = layout.data_symbols * layout.field_bits - layout.data_bits
    if data & ((1 << padding) - 1):
        raise MtmError("the symbols spell no frame of this scheme (bits that are always zero are not); read them again")
    return data >> padding


def _codeword(words: list[int], layout: Layout) -> list[int]:
    return [*words, *parity_of(words, layout.parity, layout.field_bits)] if layout.parity else words


def _corrected(received: list[int], missing: list[int], layout: Layout) -> list[int]:
    with _LIBRARY:
        codec = _codec(layout)
        from reedsolo import ReedSolomonError

        try:
            return list(codec.decode(received, erase_pos=missing)[0])
        except ReedSolomonError as error:
            raise MtmError(
                f"more symbols are wrong or missing than {layout.parity} code symbols of parity can correct; "
                "record for longer"
            ) from error


def _codec(layout: Layout) -> RSCodec:
    try:
        from reedsolo import RSCodec
    except ImportError as error:
        raise MtmError(
            "correcting a Reed-Solomon code needs reedsolo, which is not installed; install it with: "
            f"{install_command('audit')}"
        ) from error
    # Made anew each time: its kind of array too is the module's, and follows the codec that was made last.
    return RSCodec(
        nsym=layout.parity,
        nsize=layout.code_symbols,
        prim=PRIMITIVE_POLYNOMIALS[layout.field_bits],
        c_exp=layout.field_bits,
    )


def _digits(data: int, layout: Layout) -> list[int]:
    padded = data << (layout.data_symbols * layout.field_bits - layout.data_bits)
    mask = (1 << layout.field_bits) - 1
    return [padded >> layout.field_bits * place & mask for place in reversed(range(layout.data_symbols))]


def _channel_symbols(words: Sequence[int], layout: Layout) -> tuple[int, ...]:
    mask = (1 << layout.symbol_bits) - 1
    shifts = [layout.symbol_bits * place for place in reversed(range(layout.group))]
    return (*(word >> shift & mask for word in words for shift in shifts), *[0] * layout.filler)


def _code_symbol(symbols: Sequence[int | None], layout: Layout) -> int | None:
    word = 0
    for symbol in symbols:
        if symbol is None:
            return None
        word = word << layout.symbol_bits | symbol
    return word
