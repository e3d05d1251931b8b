"""What an operator may ask of a running robot: another message, how it fares, and the stop.

Requests and answers are tables, one JSON line each on the control socket:

    {"command": "send", "content": {"number": 7}}    or {"text": "..."}, {"hex": "..."}, {"symbols": [...]}
    {"command": "status"}
    {"command": "stop"}
"""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from mtm_onboard.guard import Guard
from mtm_onboard.journal import Journal
from mtm_onboard.loop import LoopStats
from mtm_onboard.message import Message, content_from_table, message_of
from mtm_onboard.modulator import Modulator
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.source import Source
from mtm_onboard.transports.base import Transport

Table = dict[str, Any]

# The loop takes up a message in its next tick; after this it is held up by something.
_PATIENCE_S = 2.0


@dataclass(frozen=True)
class Session:
    """The parts of a run that can be asked or told something.

    `tick` says which one is under way; tick 0 is at `start_unix_s`, and under the rolling schedule slot `first_slot`
    begins there.
    """

    robot: str
    key: Key
    modulator: Modulator | None
    guard: Guard
    source: Source
    transport: Transport
    stats: LoopStats
    journal: Journal | None
    tick: Callable[[], int]
    start_unix_s: float
    first_slot: int


class Control:
    """Answers requests; `answer` may be called from several threads at once, and the loop waits for none of them."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._one_message_at_a_time = threading.Lock()
        self._messages = 1
        self._answers: dict[str, Callable[[Table], Table]] = {
            "send": self._send, "status": self._status, "stop": self._stop,
        }  # fmt: skip

    def answer(self, request: Table) -> Table:
        """The answer to one request; raises MtmError when it cannot be done."""
        command = request.get("command")
        if not isinstance(command, str) or command not in self._answers:
            raise MtmError(f"the command {command!r} is unknown; choose one of: {', '.join(self._answers)}")
        known = {"command", "content"} if command == "send" else {"command"}
        unknown = sorted(request.keys() - known)
        if unknown:
            raise MtmError(f"the request has an unknown field {unknown[0]!r}; remove it")
        return self._answers[command](request)

    def _send(self, request: Table) -> Table:
        session, content = self._session, request.get("content")
        modulator = session.modulator
        if modulator is None:
            raise MtmError("this robot runs without a message; end it and start it with one")
        if not isinstance(content, dict):
            raise MtmError("the request has no content; give a number, text, hex or symbols")
        with self._one_message_at_a_time:
            message = message_of(content_from_table(content), session.key, self._messages)
            queued = modulator.queue(message)
            tick = queued.start_tick(_PATIENCE_S)
            if tick is None and not modulator.withdraw(queued):
                # It was taken up at this very moment.
                tick = queued.start_tick(_PATIENCE_S)
            if tick is None:
                raise MtmError("the robot's loop stands still and took up no message; see its status and its link")
            self._messages += 1
        replaced = _number(queued.replaced)
        instead = "" if replaced is None else f", in the place of message {replaced}, which never began"
        self._note(tick, f"message {message.number} begins here, {_words(content)}{instead}")
        return self._when(tick) | {"number": message.number, "replaces": replaced}

    def _status(self, _: Table) -> Table:
        session = self._session
        guard, stats, modulator, journal = session.guard, session.stats, session.modulator, session.journal
        return {
            "robot": session.robot,
            "key": session.key.id,
            "scheme": session.key.scheme.fingerprint,
            "tick": session.tick(),
            "sent": stats.sent,
            "missed": stats.missed,
            "overruns": stats.overruns,
            "clamped": guard.clamped,
            "stale": guard.stale,
            "held": guard.held,
            "unsent": guard.unsent,
            "refused": session.source.refused + guard.refused,
            "late_p99_ms": round(1e3 * stats.lateness.quantile_s(0.99), 3),
            "stopped": guard.stopped,
            "message": None if modulator is None else _number(modulator.message),
            "waiting": None if modulator is None else _number(modulator.waiting),
            "journal_lost": None if journal is None else journal.lost,
            "link": session.transport.health(),
        }

    def _stop(self, _: Table) -> Table:
        self._session.guard.stop()
        self._note(self._session.tick(), "stop over the control socket")
        return {"stopped": True}

    def _when(self, tick: int) -> Table:
        session, scheme = self._session, self._session.key.scheme
        slot = session.first_slot + tick // scheme.message_ticks if scheme.schedule == "rolling" else None
        return {"tick": tick, "unix_s": session.start_unix_s + tick / scheme.rate_hz, "slot": slot}

    def _note(self, tick: int, text: str) -> None:
        if self._session.journal is not None:
            self._session.journal.note(tick, text)


def _number(message: Message | Sequence[int] | None) -> int | None:
    return None if message is None or isinstance(message, Sequence) else message.number


def _words(content: Table) -> str:
    return ", ".join(f"{kind} {value}" for kind, value in content.items())
