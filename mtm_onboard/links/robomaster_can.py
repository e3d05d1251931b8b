"""The RoboMaster over CAN: a companion computer in the place of DJI's intelligent controller."""

import math
import threading
import time
from typing import Any, Final

from mtm_onboard.links.base import Link, LinkBusyError
from mtm_onboard.links.can_bus import Bus, open_bus
from mtm_onboard.links.can_stream import CanStream
from mtm_onboard.links.duml import ACK, Message
from mtm_onboard.links.robomaster_messages import (
    FROM_COMPANION_ID,
    FROM_MOTION_CONTROLLER_ID,
    HEARTBEAT,
    HEARTBEAT_PAYLOAD,
    HEARTBEAT_PERIOD_S,
    SPEED,
    WORK_MODE,
    Kind,
    SequenceCounters,
    speed_payload,
    work_mode_payload,
)
from mtm_onboard.links.robomaster_presence import ANSWER_WITHIN_S, ASK_AGAIN_S, QUIET_S, Presence
from mtm_onboard.links.robomaster_telemetry import (
    ADD_NODE,
    ATTITUDE,
    POSITION,
    PUSH,
    SUBSCRIBE,
    UNSUBSCRIBE,
    VELOCITY,
    Subscription,
    Telemetry,
    add_node_payload,
    parse_push,
    subscription_payload,
    unsubscription_payload,
)
from mtm_onboard.model.clock import Clock, SystemClock
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol.errors import MtmError

# No number that another client is likely to take: a client deletes the stream of its number before it asks for it, and
# the others known count from 0.
SUBSCRIPTION: Final = Subscription(stream=0xD5, topics=(VELOCITY, ATTITUDE, POSITION), rate_hz=50)

_NODE_KNOWN = b"\x50"
_OPEN_WITHIN_S = 0.1
_STOP_TRIES = 5
_STOP_PAUSE_S = 0.005
_LOOK_AGAIN_S = 0.005
# A beat that is due within this part of a period counts as due: who serves wakes now a little later, now a little less.
_BEAT_SLACK = 0.25


class RoboMasterCan(Link):
    """One RoboMaster on one CAN bus, which takes one that is silent for none.

    `open` waits for the robot's answer to the work mode. When none comes, though the robot is heard, or when telemetry
    stays away, or while an adapter rejects frames, the link is degraded. It counts as down when the robot refuses, when
    nothing at all was heard for a second though it was asked again, or when the adapter rejects everything.

    Give either an opened python-can `bus`, which serves for one `open` and is shut down by `close`, or what `can.Bus`
    takes (`interface="socketcan", channel="can0"`); the bit rate defaults to the robot's 1 Mbit/s.
    `clock` is the runtime's.

    `service` sends a heartbeat each 10 ms and reads telemetry. It may run in a thread of its own: messages are guarded
    whole. A bus error there is only counted, in `bus_errors`, since the next `send` will meet it too. `refusals`
    counts commands that the robot answered with an error, `malformed_pushes` telemetry that could not be read,
    `missed_heartbeats` those that were due and did not leave.
    """

    service_period_s = HEARTBEAT_PERIOD_S

    def __init__(self, bus: Bus | None = None, *, clock: Clock | None = None, **bus_options: Any) -> None:
        if (bus is None) == (not bus_options):
            raise MtmError("A RoboMaster link needs an opened bus or python-can's bus options; give one of the two.")
        self.bus_errors = 0
        self.refusals = 0
        self.malformed_pushes = 0
        self.heartbeats = 0
        self.missed_heartbeats = 0
        self._clock: Clock = clock or SystemClock()
        self._presence = Presence()
        self._fault = ""
        self._asked_s = -math.inf
        self._closed_counts = (0, 0)
        self._given_bus = bus
        self._bus_options = bus_options
        self._stream: CanStream | None = None
        self._engaged = False
        self._lock = threading.Lock()
        self._sequence = SequenceCounters()
        self._telemetry: Telemetry | None = None
        self._first_beat_s: float | None = None
        self._last_beat = -1

    @property
    def telemetry(self) -> Telemetry | None:
        """The robot's newest estimate of its motion; None before the first."""
        return self._telemetry

    def counters(self) -> dict[str, int]:
        """See the class; `rejected_frames` are those of a serial adapter, `error_frames` the controller's reports."""
        stream, (rejected, errors) = self._stream, self._closed_counts
        if stream is not None:
            rejected, errors = rejected + stream.adapter_answers[0], errors + stream.error_frames
        return {
            "heartbeats": self.heartbeats, "missed_heartbeats": self.missed_heartbeats, "refusals": self.refusals,
            "bus_errors": self.bus_errors, "rejected_frames": rejected, "error_frames": errors,
            "malformed_pushes": self.malformed_pushes,
        }  # fmt: skip

    def health(self) -> dict[str, int | float | str | bool]:
        """What became of the work mode, how old the newest telemetry is, and the counters."""
        age_s = self._clock.now() - self._presence.pushed_s
        age = round(age_s, 3) if math.isfinite(age_s) else "none yet"
        return {"work_mode": self._presence.work_mode, "telemetry_age_s": age, **self.counters()}

    def open(self) -> None:
        """Open the bus, subscribe to telemetry, switch the work mode on, standing still, and wait for the answer.

        Raises MtmError when the bus cannot be opened or written to, when the robot refuses, and when nothing comes from
        it within a second; the motors are then told to let go.
        """
        with self._lock:
            if self._stream is None:
                self._stream = CanStream(self._opened_bus(), FROM_COMPANION_ID, FROM_MOTION_CONTROLLER_ID)
                self._first_beat_s = None
                self._last_beat = -1
            self._fault = self.degraded = ""
            self._presence.begin(self._clock.now())
            self._engaged = True
        try:
            self._command(UNSUBSCRIBE, unsubscription_payload(SUBSCRIPTION.stream))
            self._command(ADD_NODE, add_node_payload())
            self._command(SUBSCRIBE, subscription_payload(SUBSCRIPTION))
            self._ask()
            self._command(SPEED, speed_payload(STOP))
            self._await_answer()
        except BaseException:
            try:
                self.stop()
            finally:
                self.close()
            raise

    def send(self, velocity: BodyVelocity) -> None:
        """Send one speed command.

        Raises ValueError for values that are not finite, LinkBusyError when the bus takes it too slowly, and MtmError
        when the bus fails, the link is not open, or the robot cannot be taken to obey.
        """
        self._command(SPEED, speed_payload(velocity), self.write_bound_s)

    def stop(self) -> None:
        """Send zero speed and work mode off, each several times if the bus reports an error.

        Afterwards `send` refuses until `open`. Every call sends both while the bus is open, and nothing after
        `close`. Raises MtmError when either could not be sent.
        """
        with self._lock:
            self._engaged = False
            if self._stream is None:
                return
            halted = self._persist(self._stream, SPEED, speed_payload(STOP))
            released = self._persist(self._stream, WORK_MODE, work_mode_payload(False))
        if not (halted and released):
            raise MtmError(
                f"The stop could not be sent in {_STOP_TRIES} tries; switch the robot off by hand, then check the bus."
            )

    def close(self) -> None:
        """Shut the bus down; nothing is sent or read afterwards until `open`."""
        with self._lock:
            stream, self._stream = self._stream, None
            self._engaged = False
            if stream is not None:
                rejected, errors = self._closed_counts
                self._closed_counts = rejected + stream.adapter_answers[0], errors + stream.error_frames
        if stream is not None:
            stream.shutdown()

    def service(self, now_s: float) -> None:
        """Send the heartbeat that is due at `now_s`, never more than one, and judge what the robot has said."""
        with self._lock:
            stream = self._stream
            if stream is None:
                return
            if self._first_beat_s is None:
                self._first_beat_s = now_s
            beat = int((now_s - self._first_beat_s) / HEARTBEAT_PERIOD_S + _BEAT_SLACK)
            if beat > self._last_beat:
                self.missed_heartbeats += beat - self._last_beat - 1
                self._last_beat = beat
                has_left = self._attempt(stream, HEARTBEAT, HEARTBEAT_PAYLOAD)
                self.heartbeats += has_left
                self.missed_heartbeats += not has_left
        self._listen(stream, now_s)

    def _ask(self) -> None:
        """Ask for the work mode, under a number by which its answer will be known."""
        self._asked_s = self._clock.now()
        self._command(WORK_MODE, work_mode_payload(True), noted=True)

    def _await_answer(self) -> None:
        """Serve the link until the robot has answered; MtmError when it refuses, or was not heard at all in time."""
        clock, presence = self._clock, self._presence
        deadline_s = clock.now() + ANSWER_WITHIN_S
        while True:
            now_s = clock.now()
            clock.sleep_until(now_s)
            if self._stream is not None:
                self._listen(self._stream, now_s)
            if self._fault:
                raise MtmError(self._fault)
            if presence.work_mode == "acknowledged":
                return
            if now_s >= deadline_s:
                if math.isfinite(presence.heard_s):
                    return
                raise MtmError(presence.absence(now_s))
            if now_s - self._asked_s >= ASK_AGAIN_S:
                self._ask()
            self.service(now_s)
            clock.sleep_until(now_s + _LOOK_AGAIN_S)

    def _listen(self, stream: CanStream, now_s: float) -> None:
        """Read, judge, and ask a robot that is silent."""
        self._read(stream, now_s)
        if not self._engaged:
            return
        presence = self._presence
        presence.take_adapter(*stream.adapter_answers, now_s)
        self._fault = presence.fault(now_s)
        self.degraded = presence.doubt(now_s)
        if presence.silent_s(now_s) > QUIET_S and now_s - self._asked_s >= ASK_AGAIN_S:
            # Whoever is there answers this, and pushes again if it had forgotten.
            self._asked_s = now_s
            with self._lock:
                if self._engaged:
                    self._attempt(stream, SUBSCRIBE, subscription_payload(SUBSCRIPTION))

    def _opened_bus(self) -> Bus:
        if self._given_bus is not None:
            bus, self._given_bus = self._given_bus, None
            return bus
        if not self._bus_options:
            raise MtmError("The bus that was given is shut down; make a new transport to open the link again.")
        return open_bus(self._bus_options)

    def _command(self, kind: Kind, payload: bytes, within_s: float = _OPEN_WITHIN_S, *, noted: bool = False) -> None:
        deadline_s = time.monotonic() + within_s
        if not self._lock.acquire(timeout=within_s):
            raise LinkBusyError("The CAN bus is still busy with the message before; check that the robot is on.")
        try:
            if self._stream is None or not self._engaged:
                raise MtmError("The link to the robot is not open, or was stopped; open it before sending.")
            if self._fault:
                raise MtmError(self._fault)
            number = self._sequence.next(kind)
            if noted:
                self._presence.asked(number)
            try:
                self._stream.write(kind.message(number, payload), deadline_s - time.monotonic())
            except MtmError:
                self.bus_errors += 1
                raise
        finally:
            self._lock.release()

    def _attempt(self, stream: CanStream, kind: Kind, payload: bytes) -> bool:
        """Send one message with the lock held; a bus error is counted and gives False."""
        try:
            stream.write(kind.message(self._sequence.next(kind), payload), self.write_bound_s)
        except MtmError:
            self.bus_errors += 1
            return False
        return True

    def _persist(self, stream: CanStream, kind: Kind, payload: bytes) -> bool:
        for _ in range(_STOP_TRIES):
            if self._attempt(stream, kind, payload):
                return True
            time.sleep(_STOP_PAUSE_S)
        return False

    def _read(self, stream: CanStream, now_s: float) -> None:
        # Reading takes no lock: some adapters wait a millisecond for a byte, and a command must not wait with them.
        try:
            messages = stream.read()
        except MtmError:
            if self._stream is not None:
                self.bus_errors += 1
            return
        for message in messages:
            self._take(message, now_s)

    def _take(self, message: Message, now_s: float) -> None:
        self._presence.hear(now_s)
        if message.attributes & ACK:
            self.refusals += _is_refusal(message)
            self._presence.take_answer(message)
        elif PUSH.matches(message):
            try:
                pushed = parse_push(message.payload, SUBSCRIPTION, now_s)
            except ValueError:
                self.malformed_pushes += 1
                return
            if pushed is not None:
                self._telemetry = pushed
                self._presence.take_push(now_s)


def _is_refusal(ack: Message) -> bool:
    """Whether the robot refused; that a stream to be ended was not running, or a node is known, is no refusal."""
    code = ack.payload[:1]
    return not (code == b"\x00" or UNSUBSCRIBE.matches(ack) or (ADD_NODE.matches(ack) and code == _NODE_KNOWN))
