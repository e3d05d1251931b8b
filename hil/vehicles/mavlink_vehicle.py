"""The vehicle's end of a MAVLink wire: an autopilot that obeys what a real one obeys, and ignores the rest."""

import math
from collections.abc import Callable
from typing import Any

from hil.vehicles.mavlink_firmware import Firmware
from hil.vehicles.motion_controller import MotionController, Plant
from mtm_onboard.links.mavlink_codec import MavlinkCodec
from mtm_onboard.links.mavlink_ports import Port
from mtm_onboard.links.mavlink_signing import signing_timestamp
from mtm_onboard.protocol import MtmError

SYSTEM_ID = 1
COMPONENT_ID = 1
HEARTBEAT_HZ = 1
MOTION_HZ = 10

_SET_MODE, _ARM_DISARM = 176, 400  # MAV_CMD
_CUSTOM_MODE, _ARMED = 1, 128  # MAV_MODE_FLAG
_ACCEPTED, _REJECTED_FOR_NOW, _UNSUPPORTED, _FAILED = 0, 1, 3, 4  # MAV_RESULT
_CRITICAL = 2  # MAV_SEVERITY
_REAL32 = 9  # MAV_PARAM_TYPE
_ADDRESSED = ("SET_POSITION_TARGET_LOCAL_NED", "COMMAND_LONG", "PARAM_REQUEST_LIST", "PARAM_REQUEST_READ")
_ACTIVE = 4  # MAV_STATE
_MOST_READS = 256
# A push that is due within this part of a period counts as due: instants are sums of decimal fractions.
_SLACK = 1e-6


class MavlinkVehicle:
    """A vehicle with `firmware` over `plant`; `poll` does everything that is due.

    It obeys set-points and requests that are addressed to it, the former only in its guided mode and armed, tells its
    parameters to whoever asks, and counts in `ignored_setpoints` those that it ignores for their frame, mask or values.
    `signing_key` has it require signatures. A vehicle that `goes_on` never stops for want of set-points, the worst that
    one could do. `can_arm` False is a vehicle whose own checks fail. `pilot_switches` and `pilot_disarms` are the
    pilot's doing.
    """

    def __init__(
        self,
        firmware: Firmware,
        plant: Plant,
        port: Port,
        *,
        is_guided: bool = False,
        is_armed: bool = False,
        can_arm: bool = True,
        signing_key: bytes | None = None,
        goes_on: bool = False,
        timestamp: Callable[[], int] = signing_timestamp,
    ) -> None:
        loss_s = None if goes_on else firmware.loss_s
        self.controller = MotionController(plant, None if firmware.leaves_on_loss else loss_s)
        self.firmware = firmware
        self.can_arm = can_arm
        self.mode = firmware.guided_mode if is_guided else firmware.other_mode
        self.is_armed = is_armed
        self.setpoints = self.ignored_setpoints = self.companion_heartbeats = self.losses = self.port_errors = 0
        self.requests: list[int] = []
        self._port = port
        self._loss_s = loss_s
        self._codec = MavlinkCodec(SYSTEM_ID, COMPONENT_ID, signing_key, timestamp)
        self._last_setpoint_s = -math.inf
        self._streamed_since_s = math.inf
        self._beats = self._motions = -1
        self._engage()

    @property
    def is_obeying(self) -> bool:
        """Whether set-points move it."""
        return self.mode == self.firmware.guided_mode and self.is_armed

    @property
    def refused_frames(self) -> int:
        """Frames that were damaged, unsigned, wrongly signed or replayed."""
        return self._codec.bad_frames + self._codec.refused_signatures

    def poll(self, now_s: float) -> None:
        """Obey what has arrived, advance the plant to `now_s` and say what is due."""
        for message in self._received():
            self._take(message, now_s)
        self._check_loss(now_s)
        self.controller.advance(now_s)
        self._report(now_s)

    def pilot_switches(self, mode: int) -> None:
        """Take the vehicle over, or hand it back."""
        self.mode = mode
        self._engage()

    def pilot_disarms(self) -> None:
        """Switch the motors off."""
        self.is_armed = False
        self._engage()

    def say(self, severity: int, text: str) -> None:
        """Send a text to whoever listens."""
        self._send(self._codec.messages.MAVLink_statustext_message(severity, text.encode("ascii")))

    def _engage(self) -> None:
        self.controller.set_work_mode(self.is_obeying)

    def _received(self) -> list[Any]:
        found: list[Any] = []
        try:
            for _ in range(_MOST_READS):
                data = self._port.read()
                if not data:
                    break
                found += self._codec.decode(data)
        except MtmError:
            self.port_errors += 1
        if found:
            self._port.keep_sender()
        return found

    def _send(self, message: Any) -> None:
        try:
            self._port.write(self._codec.encode(message))
        except MtmError:
            self.port_errors += 1

    def _take(self, message: Any, now_s: float) -> None:
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self.companion_heartbeats += 1
            return
        if kind in _ADDRESSED and message.target_system in (0, SYSTEM_ID):
            if message.target_component not in (0, COMPONENT_ID):
                return
            if kind == "COMMAND_LONG":
                self._answer(message, now_s)
            elif kind == "SET_POSITION_TARGET_LOCAL_NED":
                self._take_setpoint(message, now_s)
            else:
                self._tell_parameters(message)

    def _tell_parameters(self, request: Any) -> None:
        """One or all; a parameter that is not there has no answer, as on a real one."""
        parameters = self.firmware.parameters
        wanted = list(range(len(parameters)))
        if request.get_type() == "PARAM_REQUEST_READ":
            name = request.param_id
            wanted = [
                index
                for index, (known, _) in enumerate(parameters)
                if (known == name if request.param_index < 0 else index == request.param_index)
            ]
        messages = self._codec.messages
        for index in wanted:
            name, value = parameters[index]
            self._send(messages.MAVLink_param_value_message(name.encode(), value, _REAL32, len(parameters), index))

    def _take_setpoint(self, setpoint: Any, now_s: float) -> None:
        velocity = self.firmware.velocity(setpoint, self.controller.plant.heading_rad)
        if velocity is None:
            self.ignored_setpoints += 1
            return
        if now_s - self._last_setpoint_s >= self.firmware.stream_gap_s or math.isinf(self._streamed_since_s):
            self._streamed_since_s = now_s
        self._last_setpoint_s = now_s
        self.setpoints += 1
        self.controller.command_speed(now_s, *velocity)

    def _answer(self, request: Any, now_s: float) -> None:
        self.requests.append(request.command)
        result = self._result(request, now_s)
        self._engage()
        messages = self._codec.messages
        self._send(
            messages.MAVLink_command_ack_message(
                request.command, result, 0, 0, request.get_srcSystem(), request.get_srcComponent()
            )
        )

    def _result(self, request: Any, now_s: float) -> int:
        parameters = request.param1, request.param2, request.param3
        if request.command not in (_SET_MODE, _ARM_DISARM):
            return _UNSUPPORTED
        # Of the second parameter of arming, and of the third of a mode, some clients make no number.
        told = parameters[:1] if request.command == _ARM_DISARM else (*parameters[:2], _number(parameters[2]))
        if not all(math.isfinite(value) and 0 <= value < 256 for value in told):
            return _FAILED
        if request.command == _ARM_DISARM:
            if parameters[0] == 1.0 and not self.can_arm:
                self.say(_CRITICAL, "Arm: checks failed")
                return _FAILED
            self.is_armed = parameters[0] == 1.0
            return _ACCEPTED
        if not int(parameters[0]) & _CUSTOM_MODE:
            return _UNSUPPORTED
        mode = self.firmware.custom_mode(parameters[1], parameters[2])
        if mode == self.firmware.guided_mode and not self._is_streamed_to(now_s):
            return _REJECTED_FOR_NOW
        self.mode = mode
        return _ACCEPTED

    def _is_streamed_to(self, now_s: float) -> bool:
        firmware = self.firmware
        if firmware.stream_s == 0.0:
            return True
        is_fresh = now_s - self._last_setpoint_s < firmware.stream_gap_s
        return is_fresh and now_s - self._streamed_since_s > firmware.stream_s

    def _check_loss(self, now_s: float) -> None:
        is_lost = self._loss_s is not None and now_s - self._last_setpoint_s > self._loss_s
        if is_lost and self.firmware.leaves_on_loss and self.mode == self.firmware.guided_mode:
            self.losses += 1
            self.mode = self.firmware.other_mode
            self._engage()

    def _report(self, now_s: float) -> None:
        messages = self._codec.messages
        beats, motions = int(now_s * HEARTBEAT_HZ + _SLACK), int(now_s * MOTION_HZ + _SLACK)
        if beats > self._beats:
            self._beats = beats
            base_mode = _CUSTOM_MODE | _ARMED * self.is_armed
            self._send(
                messages.MAVLink_heartbeat_message(
                    self.firmware.vehicle_type, self.firmware.autopilot, base_mode, self.mode, _ACTIVE, 3
                )
            )
        if motions > self._motions:
            self._motions = motions
            self._send_motion(round(1e3 * now_s))

    def _send_motion(self, boot_ms: int) -> None:
        """ATTITUDE and LOCAL_POSITION_NED; the world's x axis is north, so that y is west."""
        messages, plant = self._codec.messages, self.controller.plant
        (x_m, y_m), (ahead, left, turn) = plant.position_xy_m, plant.velocity_body
        cosine, sine = math.cos(plant.heading_rad), math.sin(plant.heading_rad)
        yaw_rad = math.remainder(-plant.heading_rad, math.tau)
        north, west = cosine * ahead - sine * left, sine * ahead + cosine * left
        self._send(messages.MAVLink_attitude_message(boot_ms, 0.0, 0.0, yaw_rad, 0.0, 0.0, -turn))
        self._send(messages.MAVLink_local_position_ned_message(boot_ms, x_m, -y_m, 0.0, north, -west, 0.0))


def _number(value: float) -> float:
    """What is not a number stands for nothing said."""
    return 0.0 if math.isnan(value) else value
