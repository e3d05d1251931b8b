"""The runtime: what happens in one tick, from the newest base command to the robot."""

import math
from typing import Protocol

from mtm_onboard.journal.journal import Journal
from mtm_onboard.links.base import Transport
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.runtime.guard import Guard
from mtm_onboard.runtime.source import Source


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
        transport: Transport,
        journal: Journal | None = None,
    ) -> None:
        if modulator is not None:
            modulator.require_body_axes()
        self.transport_errors = 0
        self._up_since_s: float | None = -math.inf
        self._after_s = -math.inf
        self._dropped = transport.dropped
        self._stop_noted = False
        self._modulator = modulator
        self._guard = guard
        self._source = source
        self._transport = transport
        self._journal = journal

    def step(self, tick: int, now_s: float) -> None:
        """Send one command: newest base, guard, noise, limits, send; the journal and the next window come after.

        While the link is down the robot is held at a standstill, and once it is back until a base command has come.
        Raises MtmError when the transport fails, after the robot was told to stop.
        """
        guard, modulator, transport = self._guard, self._modulator, self._transport
        velocity, arrived_s, stop = self._source.poll(now_s)
        if stop and not self._stop_noted:
            self._stop_noted = True
            guard.stop()
            self._note(tick, self._source.stop_reason)
        if transport.up_since_s != self._up_since_s:
            self._follow_link(tick, now_s)
        base = guard.admit(velocity, arrived_s, now_s, after_s=self._after_s)
        wanted = base if modulator is None or not guard.noise_allowed else modulator.add(tick, base)
        sent = guard.limit(base, wanted)
        try:
            transport.send(sent)
        except Exception as error:
            self._note(tick, f"the link failed: {error}")
            self._give_up(error)
        if transport.dropped != self._dropped:
            self._dropped = transport.dropped
            guard.not_sent()
        if self._journal is not None:
            self._journal.append(tick, now_s, base, sent, guard.flags)
        if modulator is not None:
            modulator.prepare(tick)

    def _follow_link(self, tick: int, now_s: float) -> None:
        """The link went down or came back; of the commands that arrived up to now none moves the robot any more."""
        before_s, since_s = self._up_since_s, self._transport.up_since_s
        self._up_since_s = since_s
        # A source may say of a command that it arrived now although it came before the link did.
        self._after_s = math.inf if since_s is None else now_s
        if before_s is not None:
            self.transport_errors += 1
            self._note(tick, f"the link was lost: {self._transport.fault}")
        if since_s is not None:
            self._note(tick, "the link is back")

    def _note(self, tick: int, text: str) -> None:
        if self._journal is not None:
            self._journal.note(tick, text)

    def _give_up(self, error: Exception) -> None:
        self.transport_errors += 1
        try:
            self._transport.stop()
        except Exception as second:
            raise MtmError(
                f"the robot's link failed ({error}) and so did the stop ({second}); stop the robot by hand"
            ) from error
        raise MtmError(f"the robot's link failed ({error}) and the robot was told to stop; check the link") from error
