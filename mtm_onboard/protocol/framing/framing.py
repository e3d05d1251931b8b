"""How a message is framed: which bits stand beside the payload, and how they fill the symbols."""

from dataclasses import KW_ONLY, dataclass
from typing import Literal, get_args

from mtm_onboard.protocol.errors import MtmError

PayloadKind = Literal["integer", "bytes", "text"]
CheckKind = Literal["none", "crc", "tag"]
CodeKind = Literal["none", "reed-solomon"]

# Generator polynomials of the standard CRCs of these widths, highest power left out (16: CCITT, 24: OpenPGP,
# 32: IEEE 802.3, 40: GSM, 64: ECMA-182).
CRC_POLYNOMIALS = {16: 0x1021, 24: 0x864CFB, 32: 0x04C11DB7, 40: 0x0004820009, 64: 0x42F0E1EBA9EA3693}
_MAX_INTEGER_BITS = 64
_MAX_BYTES = 64
_MAX_NUMBER_BITS = 16
_CHECK_BITS = (16, 64)
_MAX_FIELD_BITS = 16
_LEAST_PARITY = 2


@dataclass(frozen=True)
class Framing:
    """What a frame holds. Raises MtmError on construction when it cannot be built.

    `payload_bits` counts an integer's bits (1 to 64), or 8 for each of the most bytes that a payload of bytes or
    UTF-8 text may have (64 at most); shorter ones are padded, and their length is part of the frame. `number_bits`
    carry the message's number, which counts modulo 2 ** number_bits (0: not carried). `check` is a cyclic redundancy
    check or the keyed tag, of `check_bits`. A Reed-Solomon `code` turns every symbol left free into parity.
    `interleave` deals the symbols over channels and time, see `order.frame_order`.
    """

    payload: PayloadKind
    payload_bits: int
    _: KW_ONLY
    number_bits: int = 0
    check: CheckKind = "none"
    check_bits: int = 0
    code: CodeKind = "none"
    interleave: bool = False

    def __post_init__(self) -> None:
        _check_types(self)
        _check_payload(self)
        if self.number_bits > _MAX_NUMBER_BITS:
            raise MtmError(f"number_bits is {self.number_bits}; choose 0 to {_MAX_NUMBER_BITS}")
        _check_check(self)

    @property
    def length_bits(self) -> int:
        """Bits that say how many bytes the payload has, less one; an integer needs none."""
        return 0 if self.payload == "integer" else (self.payload_bits // 8 - 1).bit_length()

    @property
    def data_bits(self) -> int:
        """Bits of number, length, payload and check together."""
        return self.number_bits + self.length_bits + self.payload_bits + self.check_bits


@dataclass(frozen=True)
class Layout:
    """How a frame fills the symbols of a message.

    A channel symbol is `symbol_bits` wide (log2 M); `group` of them make one code symbol of GF(2 ** field_bits). The
    codeword has `code_symbols`, the first `data_symbols` of which hold the data and the others parity; without a code
    there is no parity and `group` is 1. `filler` channel symbols after the codeword are zero.
    """

    data_bits: int
    symbol_bits: int
    field_bits: int
    data_symbols: int
    code_symbols: int
    filler: int

    @property
    def group(self) -> int:
        """Channel symbols in one code symbol."""
        return self.field_bits // self.symbol_bits

    @property
    def parity(self) -> int:
        """Code symbols of parity."""
        return self.code_symbols - self.data_symbols


def layout_of(framing: Framing, alphabet_size: int, message_symbols: int) -> Layout:
    """The layout of a frame in `message_symbols` symbols of that alphabet.

    Raises MtmError when the alphabet is no power of two or the frame does not fit, and says how many symbols would do.
    """
    symbol_bits = alphabet_size.bit_length() - 1
    if alphabet_size < 2 or alphabet_size != 1 << symbol_bits:
        raise MtmError(f"a framing needs an alphabet_size that is a power of two, and {alphabet_size} is none; "
                       f"choose {1 << symbol_bits} or {2 << symbol_bits}")  # fmt: skip
    layout = _fitted(framing, symbol_bits, message_symbols)
    if layout is not None:
        return layout
    needed = _symbols_that_hold(framing, symbol_bits, message_symbols)
    if needed is None:
        most = ((1 << symbol_bits * (_MAX_FIELD_BITS // symbol_bits)) - 1) * (_MAX_FIELD_BITS // symbol_bits)
        raise MtmError(f"a Reed-Solomon frame over an alphabet of {alphabet_size} has {most} symbols at most; "
                       "shorten the message or the frame")  # fmt: skip
    parity = f" and {_LEAST_PARITY} code symbols of parity" if framing.code != "none" else ""
    raise MtmError(f"the frame's {framing.data_bits} bits{parity} do not fit into the {message_symbols} symbols of a "
                   f"message; {needed} symbols would hold them")  # fmt: skip


def _fitted(framing: Framing, symbol_bits: int, message_symbols: int) -> Layout | None:
    if framing.code == "none":
        count = -(-framing.data_bits // symbol_bits)
        filler = message_symbols - count
        return Layout(framing.data_bits, symbol_bits, symbol_bits, count, count, filler) if filler >= 0 else None
    for group in range(1, _MAX_FIELD_BITS // symbol_bits + 1):
        field_bits, count = group * symbol_bits, message_symbols // group
        if count < 1 << field_bits:
            data = -(-framing.data_bits // field_bits)
            filler = message_symbols - count * group
            layout = Layout(framing.data_bits, symbol_bits, field_bits, data, count, filler)
            return layout if layout.parity >= _LEAST_PARITY else None
    return None


def _symbols_that_hold(framing: Framing, symbol_bits: int, too_few: int) -> int | None:
    start = max(-(-framing.data_bits // symbol_bits), too_few + 1)
    # The last data symbol may be half empty, and with the parity this is at most four symbols of the largest field.
    most = start + (_LEAST_PARITY + 2) * _MAX_FIELD_BITS
    return next((count for count in range(start, most) if _fitted(framing, symbol_bits, count) is not None), None)


def _check_types(framing: Framing) -> None:
    for label, values in (("payload", PayloadKind), ("check", CheckKind), ("code", CodeKind)):
        if getattr(framing, label) not in get_args(values):
            raise MtmError(
                f"the framing's {label} is {getattr(framing, label)!r}; choose one of: {', '.join(get_args(values))}"
            )
    for label in ("payload_bits", "number_bits", "check_bits"):
        value = getattr(framing, label)
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise MtmError(f"the framing's {label} is {value!r}; give a whole number")
    if not isinstance(framing.interleave, bool):
        raise MtmError(f"the framing's interleave is {framing.interleave!r}; choose true or false")


def _check_payload(framing: Framing) -> None:
    if framing.payload == "integer":
        if not 1 <= framing.payload_bits <= _MAX_INTEGER_BITS:
            raise MtmError(
                f"payload_bits is {framing.payload_bits}; an integer has 1 to {_MAX_INTEGER_BITS} bits, "
                "and bytes may have more"
            )
    elif framing.payload_bits % 8 or not 8 <= framing.payload_bits <= 8 * _MAX_BYTES:
        raise MtmError(f"payload_bits is {framing.payload_bits}; give 8 for each byte, 8 to {8 * _MAX_BYTES}")


def _check_check(framing: Framing) -> None:
    low, high = _CHECK_BITS
    if framing.check == "none":
        if framing.check_bits:
            raise MtmError(f'check_bits is {framing.check_bits} but check is "none"; choose "crc" or "tag", or 0 bits')
    elif not low <= framing.check_bits <= high:
        raise MtmError(f"check_bits is {framing.check_bits}; choose {low} to {high}")
    elif framing.check == "crc" and framing.check_bits not in CRC_POLYNOMIALS:
        widths = ", ".join(str(width) for width in CRC_POLYNOMIALS)
        raise MtmError(f"there is no CRC of {framing.check_bits} bits; choose one of: {widths}")
