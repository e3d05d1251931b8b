"""What frames are worth: how often noise and forgery pass the check, and which decoder reads the most.

The ratios of a frame follow the law of orthogonal signals in Gaussian noise: in nats N(d^2/2, d^2) for the symbol sent
and N(-d^2/2, d^2) for each other, where d is the `distance`; a tenth of the symbols is not seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from hil.experiments.runs.cells import Cell, Scalar, Values
from mtm_audit.decoding.message import decode_message
from mtm_audit.decoding.message.algebraic import corrected_codewords
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Channel, MtmError, Scheme
from mtm_onboard.protocol.framing import Frame, Framing, decode_frame, encode_frame
from mtm_onboard.protocol.framing.framing import CheckKind, CodeKind, layout_of

NOISE = "noise"
ATTACKS = ("changed symbol", "another key", "another epoch", "spliced")
DECODERS = ("hard decisions", "algebra", "all candidates")
CODES: tuple[CodeKind, ...] = ("none", "reed-solomon")
CHECKS: tuple[tuple[CheckKind, int], ...] = tuple((kind, bits) for kind in ("tag", "crc") for bits in (16, 24, 32))

# Distances at which about half of the frames are read: (code, check bits).
THRESHOLDS = {
    ("none", 16): 2.85, ("none", 24): 2.2, ("none", 32): 2.55,
    ("reed-solomon", 16): 1.4, ("reed-solomon", 24): 1.55, ("reed-solomon", 32): 1.75,
}  # fmt: skip
_COMPARED_AT = (1.8, 2.4, 3.0)
_FRAMES_A_CELL = 100
_STREAM = 4
_ALPHABET = 4
_CODED_SYMBOLS = 40
# An eighth of a frame's symbols shows another robot's message, in the comparison of decoders alone.
_FOREIGN_SYMBOLS = 5
_FOREIGN = " among foreign symbols"
_MISSING = 0.1
_ATTACK_BITS = 32
_CLEAN_NATS = 20.0


@dataclass(frozen=True, kw_only=True)
class Row:
    """One row of the table: what was done to frames of this kind, and how often which payload was read.

    `right` counts payloads that were sent under this key and epoch, `wrong` others that passed the check; `tries`
    are checks made on candidates that were not sent.
    """

    what: str
    code: str
    check: str
    check_bits: int
    distance: float
    frames: int
    right: int
    wrong: int
    tries: int

    @property
    def expected_wrong(self) -> float:
        """Wrong payloads that chance alone lets pass."""
        return self.tries * 2.0**-self.check_bits


def frame_cells(frames: int, seed: int) -> list[list[Cell]]:
    """The cells of each row: `frames` under noise for each check, half of them with a code, and twice as many attacks.

    The decoders are compared on a tenth as many.
    """

    def cells(what: str, code: str, check: str, bits: int, distance: float, count: int) -> list[Cell]:
        values: Values = {"what": what, "code": code, "check": check, "check_bits": bits, "distance": distance}
        return [Cell("frames", values, seed + row) for row in range(-(-count // _FRAMES_A_CELL))]

    lines = [
        cells(NOISE, code, check, bits, THRESHOLDS[code, bits], frames // 2) for check, bits in CHECKS for code in CODES
    ]
    lines += [cells(attack, code, "tag", _ATTACK_BITS, 0.0, frames // 4) for attack in ATTACKS for code in CODES]
    lines += [
        cells(decoder + condition, "reed-solomon", "tag", 24, distance, frames // 10)
        for condition in ("", _FOREIGN)
        for distance in _COMPARED_AT
        for decoder in DECODERS
    ]
    return lines


def row_of(cells: Sequence[Cell], results: Sequence[Values]) -> Row:
    """The sum of one row's cells."""
    asked = cells[0].parameters
    frames, right, wrong, tries = (
        sum(int(result[name]) for result in results) for name in ("frames", "right", "wrong", "tries")
    )
    return Row(
        what=str(asked["what"]),
        code=str(asked["code"]),
        check=str(asked["check"]),
        check_bits=int(asked["check_bits"]),
        distance=float(asked["distance"]),
        frames=frames,
        right=right,
        wrong=wrong,
        tries=tries,
    )


def read_frames(parameters: Values, seed: int) -> dict[str, Scalar]:
    """The counts of one cell: what was read of a hundred frames."""
    what = str(parameters["what"])
    draw = np.random.default_rng([_STREAM, seed])
    scheme = _scheme(str(parameters["code"]), str(parameters["check"]), int(parameters["check_bits"]))
    secret = draw.bytes(32)
    count = {"right": 0, "wrong": 0, "tries": 0}
    for row in range(_FRAMES_A_CELL):
        sent = (_frame(draw), _frame(draw))
        epoch = int(draw.integers(1, 2**16))
        if what in ATTACKS:
            symbols = _attacked(what, sent, scheme, secret, epoch, draw=draw, variant=seed * _FRAMES_A_CELL + row)
            ratios: Floats = np.zeros((scheme.message_symbols, _ALPHABET))
            ratios[np.arange(len(symbols)), symbols] = _CLEAN_NATS
            genuine: tuple[Frame, ...] = {"spliced": sent, "changed symbol": sent[:1]}.get(what, ())
        else:
            symbols = _symbols(sent[0], scheme, secret, epoch)
            if what.endswith(_FOREIGN):
                start = int(draw.integers(len(symbols) - _FOREIGN_SYMBOLS))
                symbols[start : start + _FOREIGN_SYMBOLS] = draw.integers(0, _ALPHABET, _FOREIGN_SYMBOLS)
            ratios = noisy_ratios(symbols, float(parameters["distance"]), draw)
            genuine = sent[:1]
        read, tried = _read(what.removesuffix(_FOREIGN), ratios, scheme, secret, epoch)
        count["right"] += read in genuine
        count["wrong"] += read is not None and read not in genuine
        count["tries"] += tried - (read in genuine)
    return {"frames": _FRAMES_A_CELL, **count}


def noisy_ratios(symbols: NDArray[np.int64], distance: float, draw: np.random.Generator) -> Floats:
    """(L, M): log-likelihood ratios, nats, of `symbols` (L,) at that distance, some of them missing (zeros)."""
    means = np.full((len(symbols), _ALPHABET), -(distance**2) / 2.0)
    means[np.arange(len(symbols)), symbols] *= -1.0
    ratios = means + distance * draw.normal(size=means.shape)
    return np.where(draw.random((len(symbols), 1)) < _MISSING, 0.0, ratios)


def _scheme(code: str, check: str, check_bits: int) -> Scheme:
    framing = Framing(
        "integer", 12, number_bits=4, check=cast(CheckKind, check), check_bits=check_bits, code=cast(CodeKind, code)
    )
    count = _CODED_SYMBOLS if code != "none" else framing.data_bits // 2
    channel = Channel("robot", "robot", ("vx", "vy"), count, 0.1)
    return Scheme(
        name="frames",
        rate_hz=50.0,
        band_hz=(1.0, 20.0),
        alphabet_size=_ALPHABET,
        message_ticks=20 * count,
        channels=(channel,),
        framing=framing,
    )


def _frame(draw: np.random.Generator) -> Frame:
    return Frame(int(draw.integers(2**12)), int(draw.integers(2**4)))


def _symbols(frame: Frame, scheme: Scheme, secret: bytes, epoch: int) -> NDArray[np.int64]:
    return np.array(encode_frame(frame.payload, scheme, secret, number=frame.number, epoch=epoch))


def _attacked(
    attack: str,
    sent: tuple[Frame, Frame],
    scheme: Scheme,
    secret: bytes,
    epoch: int,
    *,
    draw: np.random.Generator,
    variant: int,
) -> NDArray[np.int64]:
    """An attacked frame's symbols; numbers of `variant` in a row go through all changes of one symbol."""
    if attack == "another key":
        return _symbols(sent[0], scheme, draw.bytes(32), epoch)
    if attack == "another epoch":
        return _symbols(sent[0], scheme, secret, epoch - 1)
    symbols = _symbols(sent[0], scheme, secret, epoch)
    if attack == "spliced":
        place = int(draw.integers(1, len(symbols)))
        return np.concatenate([symbols[:place], _symbols(sent[1], scheme, secret, epoch)[place:]])
    place, change = divmod(variant % (len(symbols) * (_ALPHABET - 1)), _ALPHABET - 1)
    symbols[place] = (symbols[place] + 1 + change) % _ALPHABET
    return symbols


def _read(what: str, ratios: Floats, scheme: Scheme, secret: bytes, epoch: int) -> tuple[Frame | None, int]:
    """The frame read, None when its check does not hold, and how many candidates were checked."""
    if what == "hard decisions":
        symbols = [int(np.argmax(row)) if row.any() else None for row in ratios]
        return _checked(symbols, scheme, secret, epoch)
    if what == "algebra":
        assert scheme.framing is not None
        layout = layout_of(scheme.framing, scheme.alphabet_size, scheme.message_symbols)
        words = corrected_codewords(ratios, layout)
        if not len(words):
            return None, 0
        totals = ratios[np.arange(len(ratios)), words].sum(axis=1)
        return _checked(words[np.argmax(totals)].tolist(), scheme, secret, epoch)
    message = decode_message(ratios, scheme, secret, [epoch])
    if message.payload is None or message.number is None:
        return None, message.tried
    return Frame(message.payload, message.number), message.tried


def _checked(symbols: Sequence[int | None], scheme: Scheme, secret: bytes, epoch: int) -> tuple[Frame | None, int]:
    try:
        return decode_frame(symbols, scheme, secret, epoch=epoch), 1
    except MtmError:
        return None, 1
