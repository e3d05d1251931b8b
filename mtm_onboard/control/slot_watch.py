"""Keeps a run under the rolling schedule to slots that were never played, whatever happens to the time of day."""

import math
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from types import TracebackType
from typing import Self

from mtm_onboard.journal.ledger import Ledger
from mtm_onboard.model.clock import Clock
from mtm_onboard.model.wall_clock import WallClock
from mtm_onboard.protocol import MtmError, Scheme
from mtm_onboard.protocol.slots import next_slot, slot_start_unix_s
from mtm_onboard.runtime.message import Played
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.tick import Runtime

# What the two clocks may differ more than before without the time having been set: NTP steers both alike.
SMALLEST_STEP_S = 0.05
# Between two comparisons of the clocks, and how long before it is played a slot is kept on disk.
_LOOK_S = 1.0
_AHEAD_S = 3.0
# From a new plan to its first slot, so that the disk can keep it.
_LEAD_S = 0.5
# Between two readings of the monotonic clock around one of the time of day; a longer one is made again.
_QUICK_S = 0.002
_TRIES = 5
_WRITE_PERIOD_S = 0.1


@dataclass(frozen=True, kw_only=True)
class Playing:
    """What is played, and when: slot `first_slot` begins at tick `first_tick`; `start_unix_s` is when tick 0 was."""

    modulator: Modulator
    first_tick: int
    first_slot: int
    start_unix_s: float


class SlotWatch:
    """Watches the time of day during a run, and keeps in the ledger which slots it may have played.

    `play(message, first_slot)` makes the modulator of a plan. Nothing is played that the ledger has not on disk: a
    thread writes ahead, or, with `threaded` False, the loop itself. When the time is set, the noise ends at once;
    `note(tick, sentence)` is told, and the message begins anew at the next slot that was never played, as soon as
    `is_trusted()`. Without a ledger no slot is kept, and only steps during the run are seen.
    """

    def __init__(
        self,
        playing: Playing,
        *,
        scheme: Scheme,
        runtime: Runtime,
        clock: Clock,
        wall: WallClock,
        start_s: float,
        ledger: Ledger | None,
        play: Callable[[Played, int], Modulator],
        is_trusted: Callable[[], bool],
        note: Callable[[int, str], None],
        threaded: bool,
    ) -> None:
        self.playing = playing
        self.doubt = ""
        self._scheme, self._runtime, self._ledger = scheme, runtime, ledger
        self._clock, self._wall, self._start_s = clock, wall, start_s
        self._play, self._is_trusted, self._note = play, is_trusted, note
        self._offset_s = playing.start_unix_s - start_s
        self._look_ticks = max(1, math.ceil(_LOOK_S * scheme.rate_hz))
        self._waiting = False
        # Slots that were played before this plan, and what the writing thread is to keep, and has kept.
        self._played = -1 if ledger is None else ledger.last_slot
        self._wanted = self._kept = self._played
        self._fault = ""
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="slots", daemon=True) if threaded else None
        if ledger is not None:
            ledger.reserve(playing.first_slot)
            self._kept = ledger.last_slot
        self._allow()
        runtime.watch(self._look)

    def plays(self, tick: int) -> bool:
        """Whether there is noise at this tick when all is well."""
        part = self.playing
        return tick < self._runtime.noise_until_tick and part.modulator.sends(tick - part.first_tick)

    def __enter__(self) -> Self:
        if self._thread is not None:
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending.set()
        if self._thread is not None:
            self._thread.join()
        if self._ledger is not None:
            # The slots that were kept ahead are free for the next run, which begins where this one ended.
            # A disk that does not take this has them as played, which does no harm.
            with suppress(MtmError):
                self._ledger.release(self._slot_begun(self._tick_now()))

    def _look(self, tick: int) -> int:
        """Compare the clocks, make a new plan when it is time, and have the coming slots kept; the next look's tick."""
        offset_s = self._measured_offset_s()
        if offset_s is not None:
            self._compare(tick, offset_s)
        if not self._waiting:
            part = self.playing
            ahead = tick + math.ceil(_AHEAD_S * self._scheme.rate_hz) - part.first_tick
            self._wanted = part.first_slot + max(0, ahead // self._scheme.message_ticks)
            if self._thread is None:
                self._keep()
            self._allow()
        # Soon again while the disk has not answered.
        return tick + (self._look_ticks if self._kept >= self._wanted else max(1, self._look_ticks // 10))

    def _compare(self, tick: int, offset_s: float) -> None:
        step_s = offset_s - self._offset_s
        if not self._waiting and abs(step_s) >= SMALLEST_STEP_S:
            self._played = self._slot_begun(tick)
            self._waiting = True
            self._runtime.noise_until_tick = -math.inf
            self._tell(tick, f"{_set(step_s)}: no noise until it is known to be right")
        if self._waiting and self._is_trusted():
            self._plan_anew(tick, offset_s, step_s)

    def _plan_anew(self, tick: int, offset_s: float, step_s: float) -> None:
        scheme, former = self._scheme, self.playing
        now_unix_s = self._clock.now() + offset_s
        slot = max(next_slot(now_unix_s + _LEAD_S, scheme), self._played + 1)
        try:
            modulator = self._play(former.modulator.waiting or former.modulator.message, slot)
        except MtmError as error:
            # Such as a day that the key is not for; the time may be set once more.
            self._tell_once(tick, f"{_set(step_s)}: no noise ({error})")
            return
        start_unix_s = slot_start_unix_s(slot, scheme)
        first_tick = math.ceil((start_unix_s - offset_s - self._start_s) * scheme.rate_hz - 0.5)
        self._offset_s, self._waiting = offset_s, False
        self.playing = Playing(
            modulator=modulator, first_tick=first_tick, first_slot=slot, start_unix_s=self._start_s + offset_s
        )
        self._runtime.play(modulator, first_tick)
        self._tell(tick, f"{_set(step_s)}: the message begins anew at {utc(start_unix_s)}, slot {slot}")

    def _tell_once(self, tick: int, sentence: str) -> None:
        if sentence != self.doubt:
            self._tell(tick, sentence)

    def _tell(self, tick: int, sentence: str) -> None:
        self.doubt = sentence
        self._note(tick, sentence)

    def _measured_offset_s(self) -> float | None:
        """The time of day less the loop's clock; None when the thread lost its processor each time between the two."""
        for _ in range(_TRIES):
            before_s = self._clock.now()
            unix_s = self._wall.unix_s()
            after_s = self._clock.now()
            if after_s - before_s <= _QUICK_S:
                return unix_s - 0.5 * (before_s + after_s)
        return None

    def _tick_now(self) -> int:
        return math.floor((self._clock.now() - self._start_s) * self._scheme.rate_hz)

    def _slot_begun(self, tick: int) -> int:
        """The last slot of which anything may have been played up to a tick, in this plan or before."""
        part = self.playing
        ticks = tick - part.first_tick
        if self._waiting or ticks < 0:
            return self._played
        return max(self._played, part.first_slot + ticks // self._scheme.message_ticks)

    def _allow(self) -> None:
        """Let noise be played up to the end of the last slot that the disk has."""
        part = self.playing
        slots = math.inf if self._ledger is None else self._kept - part.first_slot + 1
        self._runtime.noise_until_tick = part.first_tick + max(0, slots) * self._scheme.message_ticks

    def _keep(self) -> None:
        ledger = self._ledger
        if ledger is None or self._wanted <= ledger.last_slot:
            return
        try:
            ledger.reserve(self._wanted)
        except MtmError as error:
            if str(error) != self._fault:
                self._fault = str(error)
                self._tell(
                    self._tick_now(), f"{error}: the noise ends, since nobody would know which slots were played"
                )
            return
        self._fault = ""
        self._kept = ledger.last_slot

    def _run(self) -> None:
        while not self._ending.wait(_WRITE_PERIOD_S):
            self._keep()


def utc(unix_s: float) -> str:
    """An instant for people."""
    return datetime.fromtimestamp(unix_s, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")


def _set(step_s: float) -> str:
    if abs(step_s) < SMALLEST_STEP_S:
        return "the time of day was set, and set back"
    return f"the time of day was set {'forward' if step_s > 0 else 'back'} by {abs(step_s):.1f} s"
