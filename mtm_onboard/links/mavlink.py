"""A vehicle with an ArduPilot or PX4 autopilot, driven over MAVLink 2 by velocity set-points in its own frame."""

import math
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from mtm_onboard.links.base import Link, LinkBusyError, TakenOverError
from mtm_onboard.links.mavlink_codec import MavlinkCodec
from mtm_onboard.links.mavlink_messages import (
    COMPANION_COMPONENT,
    VehicleTelemetry,
    arm_request,
    companion_heartbeat,
    mode_request,
    velocity_setpoint,
)
from mtm_onboard.links.mavlink_ports import Port, port_opener
from mtm_onboard.links.mavlink_profiles import profile_named
from mtm_onboard.links.mavlink_signing import load_signing_key, signing_timestamp
from mtm_onboard.links.mavlink_state import VehicleState
from mtm_onboard.model.clock import Clock, SystemClock
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol.errors import MtmError

HEARTBEAT_PERIOD_S: Final = 1.0
# Vehicles say once a second in which mode they are; after three missed ones nobody knows who flies.
HEARTBEAT_LOST_S: Final = 3.5
HEARTBEAT_LATE_S: Final = 1.5

_STEP_S = 0.02  # between looks at the vehicle, and between set-points, while opening
_REQUEST_PERIOD_S = 1.0
_STOPS = 3  # datagrams get lost, and a vehicle that misses the stop goes on until its own time-out
_STOP_PAUSE_S = 0.02
_MOST_READS = 64  # so that a babbling line cannot hold its reader for ever
# A beat that is due within this part of a period counts as due: instants are sums of decimal fractions.
_BEAT_SLACK = 1e-6


class MavlinkLink(Link):
    """One vehicle of the kind `profile` (rover, copter or px4) at `endpoint`, see `mavlink_ports.port_opener`.

    The pilot comes first. `open` refuses until the vehicle is in GUIDED (PX4: OFFBOARD) and armed; only with
    `set_mode` and `arm` does it ask for these itself, and it waits `open_timeout_s` at most. A vehicle that leaves the
    mode or disarms while it is driven has been taken over: from then on nothing but heartbeats is sent, `send` raises
    TakenOverError, and only `open` begins anew. The vehicle is never disarmed, and never taken off or landed: `stop`
    sends zero velocity, and the vehicle's own time-out (ArduPilot 3 s, PX4's COM_OF_LOSS_T 1 s) does the rest.

    A vehicle whose heartbeat is late leaves the link degraded, and one that was not heard for 3.5 s is lost.

    With `signing_key_file` messages are signed both ways. `clock` must be the one whose time `service` is given, and
    `open_port` may take the place of the endpoint.
    """

    def __init__(
        self,
        endpoint: str = "",
        *,
        profile: str,
        baud: int = 115_200,
        target_system: int = 1,
        set_mode: bool = False,
        arm: bool = False,
        open_timeout_s: float = 10.0,
        signing_key_file: str | None = None,
        clock: Clock | None = None,
        open_port: Callable[[], Port] | None = None,
        timestamp: Callable[[], int] = signing_timestamp,
    ) -> None:
        _check_options(endpoint, target_system, set_mode, arm, open_timeout_s)
        self._profile = profile_named(profile)
        # A send may find a heartbeat on its way and then has to wait for both.
        self._open_port = open_port or port_opener(endpoint, baud, self.write_bound_s / 2)
        self._place = endpoint or "the given port"
        self._target = target_system
        self._set_mode, self._arm = set_mode, arm
        self._may_set_mode = self._may_arm = False
        self._open_timeout_s = open_timeout_s
        key = None if signing_key_file is None else load_signing_key(Path(signing_key_file))
        self._is_signed = key is not None
        # Companion computers belong to the system of their vehicle.
        self._codec = MavlinkCodec(target_system, COMPANION_COMPONENT, key, timestamp)
        self._clock: Clock = clock or SystemClock()
        self._vehicle = VehicleState(self._profile, target_system)
        self._port: Port | None = None
        self._is_engaged = False
        self._writing, self._reading = threading.Lock(), threading.Lock()
        self._first_beat_s: float | None = None
        self._last_beat = -1
        self.heartbeats = self.setpoints = self.link_errors = 0

    @property
    def telemetry(self) -> VehicleTelemetry | None:
        """The vehicle's newest estimate of its motion; None before the first."""
        return self._vehicle.telemetry

    def counters(self) -> dict[str, int]:
        """What was sent and heard, what the vehicle refused or warned of, and what went wrong on the link."""
        vehicle, codec = self._vehicle, self._codec
        return {
            "heartbeats_sent": self.heartbeats, "heartbeats_heard": vehicle.heartbeats, "setpoints": self.setpoints,
            "refusals": vehicle.refusals, "alarms": vehicle.alarms, "link_errors": self.link_errors,
            "bad_frames": codec.bad_frames, "refused_signatures": codec.refused_signatures,
            "malformed": vehicle.malformed,
        }  # fmt: skip

    def health(self) -> dict[str, int | float | str | bool]:
        """Who is in charge, what the vehicle said, and what went wrong on the link."""
        vehicle = self._vehicle
        return {
            "engaged": self._is_engaged and not vehicle.was_taken, "taken_over": vehicle.was_taken,
            "mode": vehicle.mode, "armed": vehicle.is_armed,
            "last_refusal": vehicle.last_refusal, "last_alarm": vehicle.last_alarm, **self.counters(),
        }  # fmt: skip

    def open(self) -> None:
        """Open the wire and wait until the vehicle obeys set-points; it then stands still.

        Raises MtmError, with the wire closed, when the wire cannot be had, when no vehicle of the profile's kind is
        heard, and when it does not get into its mode or armed in time; TakenOverError when it does and leaves again.
        """
        self._open(self._set_mode, self._arm)

    def resume(self) -> None:
        """As `open`, but without asking for mode or arming: while the link was lost a pilot may have changed both.

        A PX4 has then left OFFBOARD by itself, and drives again only when the pilot puts it back.
        """
        self._open(set_mode=False, arm=False)

    def _open(self, set_mode: bool, arm: bool) -> None:
        self._may_set_mode, self._may_arm = set_mode, arm
        with self._writing:
            self._is_engaged = False
            if self._port is None:
                self._port = self._open_port()
                self._first_beat_s = None
                self._last_beat = -1
        try:
            self._vehicle.forget()
            self._wait_until_ready()
            self._write_setpoint(STOP)
        except BaseException:
            self.close()
            raise
        self._is_engaged = True

    def send(self, velocity: BodyVelocity) -> None:
        """Send one set-point.

        Raises ValueError for values that are not finite or that the vehicle cannot have, TakenOverError when somebody
        has taken it over, and MtmError when the link is not open, when the vehicle was not heard lately and when the
        wire fails.
        """
        setpoint = self._setpoint(velocity)
        self._require_command(self._clock.now())
        try:
            self._write(setpoint)
        except LinkBusyError as error:
            if not error.has_begun:  # what has begun to leave is finished before the next one, and so was sent
                raise
        self.setpoints += 1

    def stop(self) -> None:
        """Send zero velocity, several times; nothing to a vehicle that was taken over, or that was never driven.

        Afterwards `send` refuses until `open`. Raises MtmError when it could not be sent once.
        """
        self._is_engaged = False
        if self._port is None or self._vehicle.heard_s is None or self._vehicle.was_taken:
            return
        sent, failure = 0, None
        for number in range(_STOPS):
            if number:
                self._clock.sleep_until(self._clock.now() + _STOP_PAUSE_S)
            try:
                self._write_setpoint(STOP)
                sent += 1
            except MtmError as error:
                failure = error
        if not sent:
            raise MtmError(f"The stop could not be sent ({failure}); take the vehicle over by remote control.")

    def close(self) -> None:
        """Release the wire; the vehicle keeps its mode and stays armed."""
        self._is_engaged = False
        with self._writing:
            port, self._port = self._port, None
        if port is not None:
            port.close()

    def service(self, now_s: float) -> None:
        """Send the heartbeat that is due at `now_s`, never more than one, and read what the vehicle has sent."""
        if self._port is None:
            return
        if self._first_beat_s is None:
            self._first_beat_s = now_s
        beat = int((now_s - self._first_beat_s) / HEARTBEAT_PERIOD_S + _BEAT_SLACK)
        if beat > self._last_beat:
            self._last_beat = beat
            try:
                self._write(companion_heartbeat(self._codec.messages))
                self.heartbeats += 1
            except MtmError:
                pass  # counted, and the next send will meet it too
        self._read(now_s)
        heard_s = self._vehicle.heard_s
        is_late = self._is_engaged and heard_s is not None and now_s - heard_s > HEARTBEAT_LATE_S
        self.degraded = "the vehicle's heartbeat is late" if is_late else ""

    def _wait_until_ready(self) -> None:
        clock = self._clock
        began_s = clock.now()
        streamed_since_s: float | None = None
        asked_s, attempt = -math.inf, 0
        while True:
            now_s = clock.now()
            self.service(now_s)
            self._require_pilots_consent()
            lack = self._lack()
            if lack is None:
                return
            if now_s - began_s >= self._open_timeout_s:
                raise MtmError(lack)
            if self._vehicle.heard_s is not None:
                if self._profile.stream_s is not None:
                    self._write_setpoint(STOP)
                    streamed_since_s = now_s if streamed_since_s is None else streamed_since_s
                streamed_s = 0.0 if streamed_since_s is None else now_s - streamed_since_s
                if now_s - asked_s >= _REQUEST_PERIOD_S and streamed_s >= (self._profile.stream_s or 0.0):
                    self._ask(attempt)
                    asked_s, attempt = now_s, attempt + 1
            clock.sleep_until(now_s + _STEP_S)

    def _lack(self) -> str | None:
        """What keeps the vehicle from obeying, in one sentence; raises MtmError for a vehicle of another kind."""
        vehicle, profile = self._vehicle, self._profile
        if vehicle.heard_s is None:
            key = ", the signing key" if self._is_signed else ""
            return (
                f"No heartbeat of system {self._target} came over {self._place} in {self._open_timeout_s:g} s; check "
                f"the endpoint, the baud rate{key} and target_system."
            )
        if not vehicle.fits_profile:
            raise MtmError(
                f"The vehicle says it is autopilot {vehicle.autopilot} and type {vehicle.vehicle_type}, which is no "
                f"{profile.name}; choose the profile that fits it."
            )
        return vehicle.lack(self._may_set_mode, self._may_arm)

    def _ask(self, attempt: int) -> None:
        messages = self._codec.messages
        if not self._vehicle.is_in_mode:
            if self._may_set_mode:
                self._write(mode_request(messages, self._profile, self._target, attempt))
        elif self._may_arm:
            self._write(arm_request(messages, self._target, attempt))

    def _require_command(self, now_s: float) -> None:
        """Raise MtmError unless the link is open, and the vehicle was heard lately and has not been taken over."""
        self._require_pilots_consent()
        heard_s = self._vehicle.heard_s
        if not self._is_engaged or heard_s is None:
            raise MtmError("The link to the vehicle is not open, or was stopped; open it before sending.")
        silent_s = now_s - heard_s
        if silent_s > HEARTBEAT_LOST_S:
            raise MtmError(f"The vehicle was last heard {silent_s:.1f} s ago; check the link to it.")

    def _require_pilots_consent(self) -> None:
        if self._vehicle.was_taken:
            raise TakenOverError(
                f"The vehicle left {self._profile.mode} or was disarmed (its mode is {self._vehicle.mode}), so "
                "somebody has taken it over; nothing more is sent until the link is opened anew."
            )

    def _setpoint(self, velocity: BodyVelocity) -> Any:
        return velocity_setpoint(self._codec.messages, self._profile, self._target, velocity, self._clock.now())

    def _write_setpoint(self, velocity: BodyVelocity) -> None:
        self._write(self._setpoint(velocity))
        self.setpoints += 1

    def _write(self, message: Any) -> None:
        with self._writing:
            if self._port is None:
                raise MtmError("The link to the vehicle is not open; open it before sending.")
            try:
                self._port.write(self._codec.encode(message))
            except MtmError:
                self.link_errors += 1
                raise

    def _read(self, now_s: float) -> None:
        # While one thread reads, what another one would find is in good hands.
        if not self._reading.acquire(blocking=False):
            return
        try:
            for _ in range(_MOST_READS):
                port = self._port
                data = b"" if port is None else port.read()
                if port is None or not data:
                    return
                for message in self._codec.decode(data):
                    if self._vehicle.take(message, now_s):
                        port.keep_sender()
        except MtmError:
            self.link_errors += self._port is not None
        finally:
            self._reading.release()


def _check_options(
    endpoint: object, target_system: object, set_mode: object, arm: object, open_timeout_s: object
) -> None:
    if not isinstance(endpoint, str):
        raise MtmError(f"the MAVLink endpoint is {endpoint!r}; give text in quotes, such as udpin:0.0.0.0:14550")
    for name, value in (("set_mode", set_mode), ("arm", arm)):
        if not isinstance(value, bool):
            raise MtmError(f"{name} is {value!r}; give true or false")
    if type(target_system) is not int or not 1 <= target_system <= 255:
        raise MtmError(f"target_system is {target_system!r}; give the vehicle's system id, 1 to 255")
    if not isinstance(open_timeout_s, int | float) or not 0 < open_timeout_s < math.inf:
        raise MtmError(f"open_timeout_s is {open_timeout_s!r}; give seconds above zero")
