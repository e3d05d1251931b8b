"""The runtime: what happens in one tick, from the newest base command to the robot."""

import math
from collections.abc import Callable
from typing import Protocol

from mtm_onboard.journal.journal import Journal
from mtm_onboard.links.base import Link
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.journal_file import PlayedSlot
from mtm_onboard.runtime.guard import Guard
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.source import Source


def _never(tick: int) -> float:
    return math.inf


class NoiseAdder(Protocol):
    """What the runtime needs of a `Modulator`, or of whatever takes its place."""

    def require_body_axes(self) -> None:
        """Raise MtmError when the channel has an axis that no body velocity has."""
        ...

    def add(self, tick: int, base: BodyVelocity) -> BodyVelocity:
        """`base` with this tick's noise added."""
        ...

    def prepare(self, tick: int) -> None:
        """Compute ahead what the ticks after `tick` need; called after the send."""
        ...


class Runtime:
    """One robot's tick. Without a modulator the base commands go out alone; without a journal nothing is recorded.

    Raises MtmError when the modulator's channel has an axis that no body velocity has.
    """

    def __init__(
        self,
        modulator: NoiseAdder | None,
        guard: Guard,
        source: Source,
        link: Link,
        journal: Journal | None = None,
    ) -> None:
        if modulator is not None:
            modulator.require_body_axes()
        self.link_losses = self.link_degradations = 0
        self._up_since_s: float | None = -math.inf
        self._after_s = -math.inf
        self._degraded = ""
        # Only a link that comes back has outages to follow.
        self._outages = link if isinstance(link, ReconnectingLink) else None
        self._dropped = 0 if self._outages is None else self._outages.dropped
        self._stop_noted = False
        self._modulator = modulator
        self._first_tick = 0
        # From this tick on there is no noise, whatever the modulator would play; set from the loop's thread.
        self.noise_until_tick: float = math.inf
        # What is not done in each tick: the journal's slots, and what somebody watches. One comparison for both.
        self._next_slot_tick = self._next_extra_tick = -math.inf
        self._next_look_tick = math.inf
        self._look: Callable[[int], float] = _never
        self._guard = guard
        self._source = source
        self._link = link
        self._journal = journal

    def play(self, modulator: NoiseAdder, first_tick: int) -> None:
        """Have another modulator's tick 0 at `first_tick`, from the next step on; from the loop's thread.

        It is not heard before `noise_until_tick` is set.
        """
        self._modulator, self._first_tick, self._next_slot_tick = modulator, first_tick, first_tick
        self.noise_until_tick = self._next_extra_tick = -math.inf

    def watch(self, look: Callable[[int], float]) -> None:
        """Have `look(tick)` called after the next tick's send, and then from the tick on that it answers."""
        self._look = look
        self._next_look_tick = self._next_extra_tick = -math.inf

    def step(self, tick: int, now_s: float, late_s: float = 0.0) -> bool:
        """Whether one command left: newest base, guard, noise, limits, send; journal and next window come after.

        `late_s` is how long after its awaited instant the tick began, for the journal. While the link is down the robot
        is held at a standstill, and once it is back until a base command has come. Raises MtmError when the link fails,
        after the robot was told to stop.
        """
        guard, modulator, link = self._guard, self._modulator, self._link
        velocity, arrived_s, stop = self._source.poll(now_s)
        if stop and not self._stop_noted:
            self._stop_noted = True
            guard.stop()
            self._note(tick, self._source.stop_reason)
        outages = self._outages
        if outages is not None and outages.up_since_s != self._up_since_s:
            self._follow_link(outages, tick, now_s)
        if link.degraded != self._degraded:
            self._follow_doubts(tick, link.degraded)
        base = guard.admit(velocity, arrived_s, now_s, after_s=self._after_s)
        if modulator is None or tick >= self.noise_until_tick or not guard.noise_allowed:
            wanted = base
        else:
            wanted = modulator.add(tick - self._first_tick, base)
        sent = guard.limit(base, wanted)
        try:
            link.send(sent)
        except Exception as error:
            guard.not_sent()
            self._record(tick, now_s, late_s, base, sent)
            self._note(tick, f"the link failed: {error}")
            self._give_up(error)
        has_left = outages is None or outages.dropped == self._dropped
        if outages is not None and not has_left:
            self._dropped = outages.dropped
            guard.not_sent()
        self._record(tick, now_s, late_s, base, sent)
        if modulator is not None:
            modulator.prepare(tick - self._first_tick)
        if tick >= self._next_extra_tick:
            self._do_extras(tick)
        return has_left

    def _record(self, tick: int, now_s: float, late_s: float, base: BodyVelocity, sent: BodyVelocity) -> None:
        if self._journal is not None:
            self._journal.append(tick, now_s, base, sent, self._guard.flags, late_s)

    def _do_extras(self, tick: int) -> None:
        if tick >= self._next_look_tick:
            self._next_look_tick = self._look(tick)
        if tick >= self._next_slot_tick:
            self._follow_slots(tick)
        self._next_extra_tick = min(self._next_look_tick, self._next_slot_tick)

    def _follow_slots(self, tick: int) -> None:
        """The journal is told once a slot what is played, where it does not say it tick by tick."""
        journal, modulator = self._journal, self._modulator
        if journal is None or not journal.hides_noise or not isinstance(modulator, Modulator):
            self._next_slot_tick = math.inf
            return
        ticks = modulator.message_ticks
        begun = self._first_tick + (tick - self._first_tick) // ticks * ticks
        self._next_slot_tick = begun + ticks
        played = modulator.slot_played(tick - self._first_tick)
        if played is not None:
            journal.played(PlayedSlot(begun, *played))

    def _follow_doubts(self, tick: int, doubt: str) -> None:
        """The link has begun or ceased to doubt that the robot obeys, or does so for another reason."""
        self.link_degradations += bool(doubt) and not self._degraded
        self._degraded = doubt
        self._note(tick, f"the link is degraded: {doubt}" if doubt else "the link is no longer degraded")

    def _follow_link(self, link: ReconnectingLink, tick: int, now_s: float) -> None:
        """The link went down or came back; of the commands that arrived up to now none moves the robot any more."""
        before_s, since_s = self._up_since_s, link.up_since_s
        self._up_since_s = since_s
        # A source may say of a command that it arrived now although it came before the link did.
        self._after_s = math.inf if since_s is None else now_s
        if before_s is not None:
            self.link_losses += 1
            self._note(tick, f"the link was lost: {link.fault}")
        if since_s is not None:
            self._note(tick, "the link is back")

    def _note(self, tick: int, text: str) -> None:
        if self._journal is not None:
            self._journal.note(tick, text)

    def _give_up(self, error: Exception) -> None:
        self.link_losses += 1
        try:
            self._link.stop()
        except Exception as second:
            raise MtmError(
                f"the robot's link failed ({error}) and so did the stop ({second}); stop the robot by hand"
            ) from error
        raise MtmError(f"the robot's link failed ({error}) and the robot was told to stop; check the link") from error
