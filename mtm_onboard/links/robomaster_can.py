"""The RoboMaster over CAN: a companion computer in the place of DJI's intelligent controller."""

import threading
import time
from typing import Any, Final

from mtm_onboard.links.base import Link, LinkBusyError
from mtm_onboard.links.can_stream import Bus, CanStream
from mtm_onboard.links.duml import ACK, Message
from mtm_onboard.links.robomaster_messages import (
    BITRATE,
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
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol.errors import MtmError

SUBSCRIPTION: Final = Subscription(stream=0, topics=(VELOCITY, ATTITUDE, POSITION), rate_hz=50)

_NODE_KNOWN = b"\x50"
_OPEN_WITHIN_S = 0.1
_STOP_TRIES = 5
_STOP_PAUSE_S = 0.005
# A beat that is due within this part of a period counts as due: instants are sums of decimal fractions.
_BEAT_SLACK = 1e-6


class RoboMasterCan(Link):
    """One RoboMaster on one CAN bus.

    Give either an opened python-can `bus`, which serves for one `open` and is shut down by `close`, or what `can.Bus`
    takes (`interface="socketcan", channel="can0"`); the bit rate defaults to the robot's 1 Mbit/s.

    `service` sends a heartbeat each 10 ms and reads telemetry. It may run in a thread of its own: messages are guarded
    whole. A bus error there is only counted, in `bus_errors`, since the next `send` will meet it too. `refusals`
    counts commands that the robot answered with an error, `malformed_pushes` telemetry that could not be read.
    """

    service_period_s = HEARTBEAT_PERIOD_S

    def __init__(self, bus: Bus | None = None, **bus_options: Any) -> None:
        if (bus is None) == (not bus_options):
            raise MtmError("A RoboMaster link needs an opened bus or python-can's bus options; give one of the two.")
        self.bus_errors = 0
        self.refusals = 0
        self.malformed_pushes = 0
        self.heartbeats = 0
        self.missed_heartbeats = 0
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

    def open(self) -> None:
        """Open the bus, subscribe to telemetry and switch the work mode on, standing still.

        Raises MtmError when the bus cannot be opened or written to; the motors are then told to let go.
        """
        with self._lock:
            if self._stream is None:
                self._stream = CanStream(self._opened_bus(), FROM_COMPANION_ID, FROM_MOTION_CONTROLLER_ID)
                self._first_beat_s = None
                self._last_beat = -1
            self._engaged = True
        try:
            self._command(UNSUBSCRIBE, unsubscription_payload(SUBSCRIPTION.stream))
            self._command(ADD_NODE, add_node_payload())
            self._command(SUBSCRIBE, subscription_payload(SUBSCRIPTION))
            self._command(WORK_MODE, work_mode_payload(True))
            self._command(SPEED, speed_payload(STOP))
        except BaseException:
            try:
                self.stop()
            finally:
                self.close()
            raise

    def send(self, velocity: BodyVelocity) -> None:
        """Send one speed command.

        Raises ValueError for values that are not finite, LinkBusyError when the bus takes it too slowly, and MtmError
        when the bus fails or the link is not open.
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
            stream.shutdown()

    def service(self, now_s: float) -> None:
        """Send the heartbeat that is due at `now_s`, never more than one, and read what the robot has pushed."""
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
                self.heartbeats += self._attempt(stream, HEARTBEAT, HEARTBEAT_PAYLOAD)
        self._read(stream, now_s)

    def _opened_bus(self) -> Bus:
        if self._given_bus is not None:
            bus, self._given_bus = self._given_bus, None
            return bus
        if not self._bus_options:
            raise MtmError("The bus that was given is shut down; make a new transport to open the link again.")
        try:
            import can
        except ImportError:
            raise MtmError("python-can is not installed; install mtm[can] to reach a robot over CAN.") from None
        try:
            bus = can.Bus(**{"bitrate": BITRATE, **self._bus_options})
        except (can.CanError, OSError, ValueError, TypeError) as error:
            raise MtmError(f"The CAN bus cannot be opened ({error}); check the interface and the channel.") from error
        serial_port = getattr(bus, "serialPortOrig", None)
        if serial_port is not None:
            # After each frame python-can would wait, without bound, until the last byte has left a serial adapter.
            serial_port.flush = lambda: None
        return bus

    def _command(self, kind: Kind, payload: bytes, within_s: float = _OPEN_WITHIN_S) -> None:
        deadline_s = time.monotonic() + within_s
        if not self._lock.acquire(timeout=within_s):
            raise LinkBusyError("The CAN bus is still busy with the message before; check that the robot is on.")
        try:
            if self._stream is None or not self._engaged:
                raise MtmError("The link to the robot is not open, or was stopped; open it before sending.")
            try:
                self._stream.write(kind.message(self._sequence.next(kind), payload), deadline_s - time.monotonic())
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
        if message.attributes & ACK:
            self.refusals += _is_refusal(message)
        elif PUSH.matches(message):
            try:
                self._telemetry = parse_push(message.payload, SUBSCRIPTION, now_s) or self._telemetry
            except ValueError:
                self.malformed_pushes += 1


def _is_refusal(ack: Message) -> bool:
    """Whether the robot refused; that a stream to be ended was not running, or a node is known, is no refusal."""
    code = ack.payload[:1]
    return not (code == b"\x00" or UNSUBSCRIBE.matches(ack) or (ADD_NODE.matches(ack) and code == _NODE_KNOWN))
