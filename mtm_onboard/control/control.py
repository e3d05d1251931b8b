"""What an operator may ask of a running robot: another message or none, how it fares, and the stop.

Requests and answers are tables, one JSON line each on the control socket:

    {"command": "send", "content": {"number": 7}}    or {"text": "..."}, {"hex": "..."}, {"symbols": [...]}
    {"command": "silence"}
    {"command": "status"}
    {"command": "stop"}
"""

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from mtm_onboard.control.slot_watch import Playing
from mtm_onboard.control.state_log import RunState, named
from mtm_onboard.journal.journal import Journal
from mtm_onboard.links.base import Link
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.runtime.guard import Guard
from mtm_onboard.runtime.loop import LoopStats
from mtm_onboard.runtime.message import SILENCE, Played, Silence, content_from_table, message_of
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.source import Source

Table = dict[str, Any]

# The loop takes up a message in its next tick; after this it is held up by something.
_PATIENCE_S = 2.0


@dataclass(frozen=True, kw_only=True)
class Session:
    """The parts of a run that can be asked or told something.

    Tick 0 is at `start_s` on the runtime's clock, whose time `now_s` says. `playing` says what is played by which count
    of slots, `plays` whether a tick has noise when all is well, `clock_doubt` what was last told of the time of day.
    `take_number` gives each message its own.
    """

    robot: str
    key: Key
    guard: Guard
    source: Source
    transport: Link
    stats: LoopStats
    journal: Journal | None
    now_s: Callable[[], float]
    start_s: float
    playing: Callable[[], Playing]
    plays: Callable[[int], bool]
    clock_doubt: Callable[[], str]
    take_number: Callable[[], int]

    @property
    def modulator(self) -> Modulator:
        """What adds the noise now."""
        return self.playing().modulator

    @property
    def tick(self) -> int:
        """The tick under way."""
        return math.floor((self.now_s() - self.start_s) * self.key.scheme.rate_hz)

    def state(self) -> RunState:
        """What an operator wants to know; may be asked from any thread."""
        guard, source, modulator, now_s = self.guard, self.source, self.modulator, self.now_s()
        # Only a link that comes back is ever down during a run.
        link = self.transport if isinstance(self.transport, ReconnectingLink) else None
        is_up = link is None or link.up_since_s is not None
        return RunState(
            stopped_by=source.stop_reason if guard.stopped else "",
            link_up=is_up,
            link_fault="" if link is None or is_up else link.fault,
            link_doubt=self.transport.degraded,
            command_age_s=guard.age_s(now_s),
            stale=guard.is_stale(now_s),
            sender=source.sender,
            intruder=source.intruder,
            message=named(modulator.message),
            waiting=named(modulator.waiting),
            sends=self.plays(self.tick),
            clock_doubt=self.clock_doubt(),
        )


class Control:
    """Answers requests; `answer` may be called from several threads at once, and the loop waits for none of them."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._one_message_at_a_time = threading.Lock()
        self._answers: dict[str, Callable[[Table], Table]] = {
            "send": self._send, "silence": self._silence, "status": self._status, "stop": self._stop,
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
        content = request.get("content")
        if not isinstance(content, dict):
            raise MtmError("the request has no content; give a number, text, hex or symbols")
        if self._session.guard.stopped:
            raise MtmError(
                "the robot was stopped for good and no message would be seen; look at it, and start its run anew"
            )
        grant = self._session.key.holding.grant
        if grant is not None and grant.kind == "public":
            raise MtmError("this run plays a disclosed key on the public channel and nothing else; end it, and run the "
                           "robot with its key")  # fmt: skip
        with self._one_message_at_a_time:
            # Without a number of its own first, so that content which does not fit takes none.
            message = message_of(content_from_table(content), self._session.key)
            message = message_of(content_from_table(content), self._session.key, self._session.take_number())
            answer = self._queue(message, f"message {message.number} begins here, {message.words}")
        return answer | {"number": message.number, "content": message.words}

    def _silence(self, _: Table) -> Table:
        with self._one_message_at_a_time:
            return self._queue(SILENCE, "silence begins here")

    def _queue(self, played: Played, note: str) -> Table:
        playing = self._session.playing()
        modulator = playing.modulator
        queued = modulator.queue(played)
        tick = queued.start_tick(_PATIENCE_S)
        if tick is None and not modulator.withdraw(queued):
            # It was taken up at this very moment.
            tick = queued.start_tick(_PATIENCE_S)
        if tick is None and self._session.playing() is not playing:
            # The time was set, and another modulator plays.
            return self._queue(played, note)
        if tick is None:
            raise MtmError("the robot's loop stands still and took up nothing; see its status and its link")
        replaced = _name(queued.replaced)
        instead = "" if replaced is None else f", in the place of {called(replaced)}, which never began"
        self._note(playing.first_tick + tick, note + instead)
        return self._when(tick, playing) | {"replaces": replaced}

    def _status(self, _: Table) -> Table:
        session, state = self._session, self._session.state()
        guard, stats, modulator, journal = session.guard, session.stats, session.modulator, session.journal
        age_s = state.command_age_s
        return {
            "robot": session.robot,
            "state": state.summary,
            "key": session.key.id,
            "scheme": session.key.scheme.fingerprint,
            "message": _name(modulator.message),
            "content": _content(modulator.message),
            "waiting": _name(modulator.waiting),
            "waiting_content": _content(modulator.waiting),
            "silent": not state.sends,
            "clock": state.clock_doubt or None,
            "stopped": guard.stopped,
            "commands": {
                "arriving": not state.stale,
                "age_s": round(age_s, 3) if math.isfinite(age_s) else None,
                "sender": state.sender or None,
                "of_others": session.source.intrusions,
                "lost": session.source.lost,
            },
            "tick": session.tick,
            "sent": stats.sent,
            "unsent": stats.unsent,
            "missed": stats.missed,
            "overruns": stats.overruns,
            "clamped": guard.clamped,
            "stale": guard.stale,
            "held": guard.held,
            "refused": session.source.refused + guard.refused,
            "late_p99_ms": round(1e3 * stats.lateness.quantile_s(0.99), 3),
            "journal_lost": None if journal is None else journal.lost,
            "link": {"up": state.link_up, "fault": state.link_fault or None} | session.transport.health(),
        }

    def _stop(self, _: Table) -> Table:
        self._session.source.stop_reason = "stop over the control socket"
        self._session.guard.stop()
        self._note(self._session.tick, "stop over the control socket")
        return {"stopped": True}

    def _when(self, modulator_tick: int, playing: Playing) -> Table:
        scheme, tick = self._session.key.scheme, playing.first_tick + modulator_tick
        slot = playing.first_slot + modulator_tick // scheme.message_ticks if scheme.schedule == "rolling" else None
        return {"tick": tick, "unix_s": playing.start_unix_s + tick / scheme.rate_hz, "slot": slot}

    def _note(self, tick: int, text: str) -> None:
        if self._session.journal is not None:
            self._session.journal.note(tick, text)


def called(name: int | str) -> str:
    """What an answer names, a message's number or "silence", in words."""
    return name if isinstance(name, str) else f"message {name}"


def _name(played: Played | None) -> int | str | None:
    if isinstance(played, Silence):
        return "silence"
    return None if played is None or isinstance(played, Sequence) else played.number


def _content(played: Played | None) -> str | None:
    """What a message says, in words; None for what says nothing."""
    return None if played is None or isinstance(played, Silence | Sequence) else played.words
