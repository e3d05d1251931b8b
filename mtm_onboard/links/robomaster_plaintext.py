"""The RoboMaster EP through its plaintext SDK, whatever line the text goes over."""

import threading
import time
from abc import abstractmethod
from dataclasses import dataclass
from typing import Final

from mtm_onboard.links.base import Link, LinkBusyError
from mtm_onboard.links.byte_stream import ByteStream
from mtm_onboard.links.plaintext_messages import (
    ENTER,
    FREE_MODE,
    QUIT,
    SEQUENCES,
    STAND_STILL,
    SUBSCRIBE,
    Answer,
    PushedHeading,
    PushedPosition,
    Splitter,
    numbered,
    parse_piece,
    speed_words,
)
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol.errors import MtmError

# A second's commands at 50 Hz. The robot queues 512 of them, and one that is obeyed late is worse than none.
MOST_UNANSWERED: Final = 50
# A fifth of a second's: a robot that answers at all does so sooner.
MANY_UNANSWERED: Final = 10

_STOP_TRIES = 5
_STOP_TRY_WITHIN_S = 0.03
_STOP_PAUSE_S = 0.005


@dataclass(frozen=True)
class PlaintextTelemetry:
    """The robot's own estimate, in REP-103 signs, from where and how it stood when it was switched on.

    `received_s` is our clock on reading the newest of the two; each is None before the first of its kind.
    """

    received_s: float
    position_xy_m: tuple[float, float] | None
    heading_rad: float | None


class RoboMasterPlaintext(Link):
    """One RoboMaster EP in SDK mode. `open` does not wait for the robot's answers; `service` reads them.

    The robot answers every command. When the last `MOST_UNANSWERED` are without an answer (it is off, it lags behind,
    or it obeys another link: the first to enter SDK mode wins, and others meet silence) the link counts as down, as it
    does when the robot says that it is not in SDK mode. The robot has no deadman: it keeps the last speed until the
    next one, `quit`, or the end of a TCP connection. Well before that, at `MANY_UNANSWERED`, it is degraded.

    `answers` counts commands that were obeyed, `refusals` those that were not, `malformed` texts that nobody could
    have meant, `link_errors` reads and writes that failed.
    """

    has_deadman = False

    def __init__(self) -> None:
        self.answers = 0
        self.refusals = 0
        self.malformed = 0
        self.link_errors = 0
        self._lock = threading.Lock()
        self._link: ByteStream | None = None
        self._splitter = Splitter()
        self._engaged = False
        self._lost: MtmError | None = None
        self._sent = 0
        self._answered = 0
        self._telemetry: PlaintextTelemetry | None = None

    @abstractmethod
    def _connect(self) -> ByteStream:
        """Open the line to the robot; raises MtmError when it cannot be had."""

    def _datagrams(self) -> list[bytes]:
        """Pushes that came beside the line."""
        return []

    @property
    def telemetry(self) -> PlaintextTelemetry | None:
        """The robot's newest estimate of its pose; None before the first."""
        return self._telemetry

    @property
    def unanswered(self) -> int:
        """Numbered commands since the last one that was answered."""
        return (self._sent - self._answered) % SEQUENCES

    def counters(self) -> dict[str, int]:
        """See the class."""
        return {
            "answers": self.answers, "refusals": self.refusals, "malformed": self.malformed,
            "link_errors": self.link_errors,
        }  # fmt: skip

    def health(self) -> dict[str, int | float | str | bool]:
        """The counters, and how many commands are without an answer."""
        return {**self.counters(), "unanswered": self.unanswered}

    def open(self) -> None:
        """Connect, enter SDK mode standing still, and ask for telemetry.

        Raises MtmError when the line cannot be had or written to; the robot is then told to stop.
        """
        # Connecting may take seconds, for which nobody should wait at the lock.
        fresh = self._connect() if self._link is None else None
        with self._lock:
            if fresh is not None:
                self._link = fresh
                self._splitter = Splitter()
            self._lost = None
            self._answered = self._sent
            self._engaged = True
        try:
            # Twice: the first may be spoilt by half a command that a program before this one has left in the line.
            self._command(ENTER + ENTER)
            for words in (STAND_STILL, FREE_MODE, SUBSCRIBE):
                self._command_numbered(words)
        except BaseException:
            try:
                self.stop()
            finally:
                self.close()
            raise

    def send(self, velocity: BodyVelocity) -> None:
        """Send one speed command.

        Raises ValueError for values that are not finite or that the robot does not take, and MtmError when the link
        is not open, failed, is blocked, or the robot does not answer.
        """
        self._command_numbered(speed_words(velocity))

    def stop(self) -> None:
        """Send zero speed and the end of SDK mode, each more than once since a UART may spoil a character.

        Afterwards `send` refuses until `open`. Every call sends both while the line is open, and nothing after
        `close`. Raises MtmError when they could not be sent.
        """
        with self._lock:
            self._engaged = False
            if self._link is None:
                return
            still = f"{STAND_STILL};".encode("ascii")
            fault = self._persist(self._link, 3 * still + 2 * QUIT)
        if fault is not None:
            raise MtmError(
                f"The stop could not be sent in {_STOP_TRIES} tries; switch the robot off by hand, then check the link."
            ) from fault

    def close(self) -> None:
        """Release the line; nothing is sent or read afterwards until `open`."""
        with self._lock:
            link, self._link = self._link, None
            self._engaged = False
        if link is not None:
            link.close()

    def service(self, now_s: float) -> None:
        """Read what the robot has said. A line that failed is counted, and the next `send` tells of it."""
        # Reading never waits, so a command that has to wait for the lock does not either.
        with self._lock:
            if self._link is None or self._lost is not None:
                return
            try:
                data = self._link.read()
            except MtmError as error:
                self._lost = error
                self.link_errors += 1
                return
        overlong = self._splitter.overlong
        for text in self._splitter.feed(data):
            self._take(text, now_s)
        self.malformed += self._splitter.overlong - overlong
        is_behind = self._engaged and self.unanswered >= MANY_UNANSWERED
        self.degraded = "the robot does not answer its commands" if is_behind else ""
        for datagram in self._datagrams():
            for text in datagram.decode("ascii", "replace").split(";"):
                self._take(text, now_s)

    def _command_numbered(self, words: str) -> None:
        with self._lock:
            link = self._working_link()
            if self.unanswered >= MOST_UNANSWERED:
                raise MtmError(
                    f"The robot has not answered the last {MOST_UNANSWERED} commands; check that it is on, that the "
                    "cable is whole, and that no other program or link holds it."
                )
            # Counted before it is written: a command that leaves in part is finished later under its own number.
            self._sent = (self._sent + 1) % SEQUENCES
            self._write(link, numbered(words, self._sent))

    def _command(self, text: bytes) -> None:
        with self._lock:
            self._write(self._working_link(), text)

    def _working_link(self) -> ByteStream:
        if self._link is None or not self._engaged:
            raise MtmError("The link to the robot is not open, or was stopped; open it before sending.")
        if self._lost is not None:
            raise MtmError(str(self._lost)) from self._lost
        return self._link

    def _write(self, link: ByteStream, text: bytes) -> None:
        try:
            # Without waiting for room: where a host's whole queue is full, one more command would be obeyed too late.
            link.write(text, 0.0)
        except LinkBusyError as error:
            self.link_errors += 1
            if not error.has_begun:  # what has begun to leave is finished before the next command, and so was sent
                raise
        except MtmError:
            self.link_errors += 1
            raise

    def _persist(self, link: ByteStream, text: bytes) -> MtmError | None:
        fault = None
        for _ in range(_STOP_TRIES):
            try:
                link.write(text, _STOP_TRY_WITHIN_S)
                return None
            except MtmError as error:
                self.link_errors += 1
                fault = error
            time.sleep(_STOP_PAUSE_S)
        return fault

    def _take(self, text: str, now_s: float) -> None:
        try:
            piece = parse_piece(text)
        except ValueError:
            self.malformed += 1
            return
        if isinstance(piece, Answer):
            self._take_answer(piece)
        elif isinstance(piece, PushedPosition):
            heading_rad = None if self._telemetry is None else self._telemetry.heading_rad
            self._telemetry = PlaintextTelemetry(now_s, piece.xy_m, heading_rad)
        elif isinstance(piece, PushedHeading):
            position_xy_m = None if self._telemetry is None else self._telemetry.position_xy_m
            self._telemetry = PlaintextTelemetry(now_s, position_xy_m, piece.rad)

    def _take_answer(self, answer: Answer) -> None:
        if answer.sequence is not None:
            ahead = (answer.sequence - self._answered) % SEQUENCES
            if answer.sequence >= SEQUENCES or not 1 <= ahead <= self.unanswered:
                self.malformed += 1
                return
            self._answered = answer.sequence
        self.answers += answer.obeyed
        self.refusals += not answer.obeyed
        if answer.is_outside:
            self._lost = MtmError("The robot has left SDK mode; check that it was not switched off and on.")
