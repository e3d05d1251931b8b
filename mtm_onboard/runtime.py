"""The runtime: what happens in one tick, from the newest base command to the robot."""

from typing import Protocol

from mtm_onboard.guard import Guard
from mtm_onboard.journal import Journal
from mtm_onboard.motion import BodyVelocity
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.source import Source
from mtm_onboard.transports.base import Transport


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
        self._modulator = modulator
        self._guard = guard
        self._source = source
        self._transport = transport
        self._journal = journal

    def step(self, tick: int, now_s: float) -> None:
        """Send one command: newest base, guard, noise, limits, send; the journal and the next window come after.

        Raises MtmError when the transport fails, after the robot was told to stop.
        """
        guard, modulator = self._guard, self._modulator
        velocity, arrived_s, stop = self._source.poll(now_s)
        if stop:
            guard.stop()
        base = guard.admit(velocity, arrived_s, now_s)
        wanted = base if modulator is None or not guard.noise_allowed else modulator.add(tick, base)
        sent = guard.limit(base, wanted)
        try:
            self._transport.send(sent)
        except Exception as error:
            self._give_up(error)
        if self._journal is not None:
            self._journal.append(tick, now_s, base, sent, guard.flags)
        if modulator is not None:
            modulator.prepare(tick)

    def _give_up(self, error: Exception) -> None:
        self.transport_errors += 1
        try:
            self._transport.stop()
        except Exception as second:
            raise MtmError(
                f"the robot's link failed ({error}) and so did the stop ({second}); stop the robot by hand"
            ) from error
        raise MtmError(f"the robot's link failed ({error}) and the robot was told to stop; check the link") from error
