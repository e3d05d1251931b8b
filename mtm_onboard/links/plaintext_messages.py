"""The RoboMaster EP's plaintext protocol: commands to text, and answers and pushes from it.

A command is words with one blank between them and ends in a semicolon, never in a new line. DJI counts y to the right,
yaw clockwise and angles in degrees; here is where that meets REP-103. Commands carry `seq n`, which the answer
repeats, so that each answer can be told from the others. The grammar is that of DJI's plaintext SDK documentation.
"""

import math
import re
from dataclasses import dataclass
from typing import Final

from mtm_onboard.links.robomaster_messages import clockwise_deg, counter_clockwise_rad, flipped
from mtm_onboard.model.velocity import STOP, BodyVelocity

BAUDRATE: Final = 115_200
CONTROL_PORT: Final = 40_923
PUSH_PORT: Final = 40_924

MOST_MPS: Final = 3.5
MOST_DEGPS: Final = 600.0
PUSHES_HZ: Final = 10

SEQUENCES: Final = 10_000  # sequence numbers run from 0 to here

ENTER: Final = b"command;"
QUIT: Final = b"quit;"

_LONGEST_TEXT = 512
_ANSWER = re.compile(r"(.*?)(?: seq ([0-9]{1,9}))?")
_DONE = frozenset({"ok", "Already in SDK mode"})
_OUTSIDE = "not in sdk mode"
_REFUSED = re.compile(rf"fail|error|quit sdk mode failed|{_OUTSIDE}|command format error.*|.* exec error")
_NUMBER = re.compile(r"[+-]?[0-9]{1,9}(?:\.[0-9]{1,9})?")
_PUSH_PREFIX = "chassis push "
_PUSH_NUMBERS = {"position": (2, 3), "attitude": (3,)}


@dataclass(frozen=True)
class Answer:
    """What the robot says to one command: whether it obeyed, and the command's number when it had one.

    `is_outside` says that it did not since it is not in SDK mode, as after it was switched off and on.
    """

    obeyed: bool
    sequence: int | None
    is_outside: bool = False


@dataclass(frozen=True)
class PushedPosition:
    """Position in REP-103 signs from where and how the robot stood when it was switched on."""

    xy_m: tuple[float, float]


@dataclass(frozen=True)
class PushedHeading:
    """Heading counter-clockwise from that at switching on."""

    rad: float


@dataclass(frozen=True)
class PushEnd:
    """The end of a push, which says nothing."""


Piece = Answer | PushedPosition | PushedHeading | PushEnd


def numbered(words: str, sequence: int) -> bytes:
    """A command of these words with its number."""
    return f"{words} seq {sequence};".encode("ascii")


def speed_words(velocity: BodyVelocity) -> str:
    """A speed command without its number, to 0.1 mm/s and 0.001 deg/s.

    Raises ValueError for values that are not finite or that the protocol does not take.
    """
    if not velocity.is_finite():
        raise ValueError(f"the command {tuple(velocity)} is not finite; send finite speeds only")
    rightward_mps, clockwise_degps = flipped(velocity.vy_mps), clockwise_deg(velocity.wz_radps)
    if max(abs(velocity.vx_mps), abs(rightward_mps)) > MOST_MPS or abs(clockwise_degps) > MOST_DEGPS:
        raise ValueError(
            f"the command {tuple(velocity)} is beyond the {MOST_MPS:g} m/s and {MOST_DEGPS:g} deg/s of the plaintext "
            "protocol; lower the limits of speed and turn rate"
        )
    return f"chassis speed x {velocity.vx_mps:z.4f} y {rightward_mps:z.4f} z {clockwise_degps:z.3f}"


STAND_STILL: Final = speed_words(STOP)
# Neither gimbal nor chassis then follows the other: while the gimbal leads the chassis ignores every turn.
FREE_MODE: Final = "robot mode free"
SUBSCRIBE: Final = f"chassis push position on pfreq {PUSHES_HZ} attitude on afreq {PUSHES_HZ}"


def parse_piece(text: str) -> Piece:
    """What stands between two semicolons; raises ValueError when it is nothing that a robot says unasked.

    A push holds several attributes, each of which ends in a semicolon, and has one more at its end; only the first
    attribute has the words `chassis push` in front of it.
    """
    text = text.strip(" ")
    if not text:
        return PushEnd()
    words = text.removeprefix(_PUSH_PREFIX).split(" ")
    if words[0] in _PUSH_NUMBERS:
        return _pushed(words[0], words[1:])
    match = _ANSWER.fullmatch(text)
    if match is not None and (match[1] in _DONE or _REFUSED.fullmatch(match[1])):
        return Answer(match[1] in _DONE, None if match[2] is None else int(match[2]), match[1] == _OUTSIDE)
    raise ValueError(f"{text[:80]!r} is no answer and no push")


def _pushed(name: str, words: list[str]) -> Piece:
    if len(words) not in _PUSH_NUMBERS[name] or not all(_NUMBER.fullmatch(word) for word in words):
        raise ValueError(f"{words[:4]} are not the numbers of {name}")
    first, second, *rest = map(float, words)
    if name == "position":
        # Newer firmware adds the heading, which the attitude says as well.
        return PushedPosition((first, flipped(second)))
    # Pitch and roll come first.
    return PushedHeading(math.remainder(counter_clockwise_rad(rest[0]), math.tau))


class Splitter:
    """Cuts a stream of text, read in any portions, at its semicolons; each piece is without it.

    What is too long to be a command or an answer is dropped up to the next semicolon, and counted in `overlong`.
    """

    def __init__(self, longest: int = _LONGEST_TEXT) -> None:
        self.overlong = 0
        self._longest = longest
        self._tail = bytearray()
        self._is_dropping = False

    def feed(self, data: bytes) -> list[str]:
        """Append `data` and return every piece that is complete now; bytes that are not ASCII become U+FFFD."""
        *ended, tail = data.split(b";")
        pieces = []
        for part in ended:
            self._append(part)
            if not self._is_dropping:
                pieces.append(self._tail.decode("ascii", "replace"))
            self.clear()
        self._append(tail)
        return pieces

    def clear(self) -> None:
        """Forget the piece that is not complete."""
        self._tail.clear()
        self._is_dropping = False

    def _append(self, part: bytes) -> None:
        if self._is_dropping:
            return
        self._tail += part
        if len(self._tail) > self._longest:
            self.overlong += 1
            self._is_dropping = True
            self._tail.clear()
