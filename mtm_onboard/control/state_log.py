"""What a run tells its operator while it runs: one sentence for each change of its state."""

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from mtm_onboard.runtime.message import Played, Silence

_PERIOD_S = 0.1
# Whoever reads the sentences may have gone away.
_LONGEST_FAREWELL_S = 1.0


@dataclass(frozen=True, kw_only=True)
class RunState:
    """What an operator wants to know of a run at one moment.

    `stopped_by` says why the robot was stopped for good, `link_fault` why the link is down and `link_doubt` why it is
    degraded, each "" when it is not. `command_age_s` is infinite before the
    first base command. `message` and `waiting` say in words what is played and what takes its place at the next
    boundary, None for nothing; `sends` says whether there is noise at this tick when all is well. `clock_doubt` is what
    was last told of the time of day, "" when nothing was.
    """

    stopped_by: str
    link_up: bool
    link_fault: str
    link_doubt: str
    command_age_s: float
    stale: bool
    sender: str
    intruder: str
    message: str | None
    waiting: str | None
    sends: bool
    clock_doubt: str = ""

    @property
    def summary(self) -> str:
        """The state in a few words, the worst first."""
        if self.stopped_by:
            return "stopped for good"
        if not self.link_up:
            return "the link is down"
        if self.stale:
            return "standing still without base commands"
        return "driving with the message" if self.sends else "driving without a message"


def named(played: Played | None) -> str | None:
    """A message in words with its number; "silence" for silence, None for nothing."""
    if isinstance(played, Silence):
        return "silence"
    # Symbols of one channel are no message with a number.
    if played is None or isinstance(played, Sequence):
        return None
    return f"message {played.number}, {played.words}"


def changes(before: RunState | None, now: RunState) -> Iterator[str]:
    """A sentence for each thing that is another one than before; all that matters at first."""
    if now.stopped_by and (before is None or not before.stopped_by):
        yield f"{now.stopped_by}: the robot stands still until the run is started anew"
    if before is None or before.link_up != now.link_up:
        yield "the link is up" if now.link_up else f"the link is down ({now.link_fault or 'no reason known'})"
    if now.clock_doubt and (before is None or before.clock_doubt != now.clock_doubt):
        yield now.clock_doubt
    if now.link_doubt != ("" if before is None else before.link_doubt):
        yield f"the link is degraded: {now.link_doubt}" if now.link_doubt else "the link is no longer degraded"
    if not now.stopped_by and (before is None or before.stale != now.stale):
        yield _commands(now)
    elif now.sender and before is not None and before.sender and before.sender != now.sender:
        yield f"base commands now come from {now.sender}"
    if now.intruder and (before is None or before.intruder != now.intruder):
        yield f"{now.intruder} sends base commands as well; they are refused as long as {now.sender} sends"
    if before is not None and (before.message, before.sends) != (now.message, now.sends):
        ended = before.message == now.message and before.sends
        yield "the message has ended" if ended else f"{now.message or 'the message'} begins"
    if now.waiting and (before is None or before.waiting != now.waiting):
        yield f"{now.waiting} waits for the next boundary"


def _commands(state: RunState) -> str:
    if not state.stale:
        return f"base commands come{f' from {state.sender}' if state.sender else ''}"
    if state.command_age_s == float("inf"):
        return "no base command has come yet: the robot stands still"
    return "base commands have stopped coming: no noise, and the robot stands still"


class StateLog:
    """Looks at the state ten times a second while its block runs, and says what has changed.

    In a thread of its own: a reader that is slow, or has gone, holds up no tick and no stop.
    """

    def __init__(self, look: Callable[[], RunState], say: Callable[[str], None]) -> None:
        self._look = look
        self._say = say
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="state log", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending.set()
        self._thread.join(_LONGEST_FAREWELL_S)

    def _run(self) -> None:
        before: RunState | None = None
        while True:
            now = self._look()
            with suppress(OSError, ValueError):
                for sentence in changes(before, now):
                    self._say(sentence)
            before = now
            if self._ending.wait(_PERIOD_S):
                return
