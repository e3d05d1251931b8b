"""What a vehicle has said of itself over MAVLink: mode, arming, motion, refusals and alarms."""

from typing import Any, Final

from mtm_onboard.links.mavlink_messages import (
    ARM_DISARM,
    ARMED_FLAG,
    AUTOPILOT_COMPONENT,
    DO_SET_MODE,
    VehicleTelemetry,
    telemetry,
)
from mtm_onboard.links.mavlink_profiles import Profile

_ACCEPTED = 0  # MAV_RESULT
_IN_PROGRESS = 5
_WARNING = 4  # MAV_SEVERITY; what is worse has a lower number
_REQUESTS: Final = {DO_SET_MODE: "the mode", ARM_DISARM: "arming"}


class VehicleState:
    """The autopilot of one system, read by `profile`.

    `mode` is the custom mode of its newest heartbeat and `heard_s` when that came, None before the first. `was_taken`
    is set when it has left the profile's mode, or was disarmed, after it was seen otherwise. `refusals` counts requests
    that it answered with anything but yes, `alarms` its texts of severity warning or worse, of which `last_alarm` is
    the newest, and `malformed` telemetry that is not finite.
    """

    def __init__(self, profile: Profile, system_id: int) -> None:
        self.refusals = self.alarms = self.malformed = 0
        self.last_refusal = self.last_alarm = ""
        self.heartbeats = 0
        self.heard_s: float | None = None
        self.autopilot = self.vehicle_type = self.mode = -1
        self.is_armed = False
        self.was_taken = False
        self.telemetry: VehicleTelemetry | None = None
        self._profile = profile
        self._system_id = system_id
        self._was_in_mode = self._was_armed = False
        self._attitude: Any = None

    @property
    def fits_profile(self) -> bool:
        """Whether the vehicle that was heard is one of the profile's kind."""
        return self.autopilot == self._profile.autopilot and self.vehicle_type in self._profile.vehicle_types

    @property
    def is_in_mode(self) -> bool:
        """Whether it is in the mode that obeys set-points."""
        return self.mode == self._profile.custom_mode

    def forget(self) -> None:
        """Let only heartbeats from now on count."""
        self.heard_s = None
        self.was_taken = self._was_in_mode = self._was_armed = False

    def lack(self, may_set_mode: bool, may_arm: bool) -> str | None:
        """What keeps the vehicle that was heard from obeying, in one sentence, and what to do about it."""
        profile = self._profile
        said = "; ".join(text for text in (self.last_refusal, self.last_alarm) if text) or "nothing so far"
        if not self.is_in_mode:
            way = (
                f"look at what it says ({said})"
                if may_set_mode
                else "switch it over, or allow that with set_mode = true"
            )
            return f"The vehicle is not in {profile.mode} (its mode is {self.mode}); {way}."
        if not self.is_armed:
            way = f"look at what it says ({said})" if may_arm else "arm it, or allow that with arm = true"
            return f"The vehicle is not armed; {way}."
        return None

    def take(self, message: Any, now_s: float) -> bool:
        """Read one message; True for a heartbeat of this vehicle's autopilot."""
        if (message.get_srcSystem(), message.get_srcComponent()) != (self._system_id, AUTOPILOT_COMPONENT):
            return False
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self.heartbeats += 1
            self.heard_s = now_s
            self.autopilot, self.vehicle_type = message.autopilot, message.type
            self.mode, self.is_armed = message.custom_mode, bool(message.base_mode & ARMED_FLAG)
            if (self._was_in_mode and not self.is_in_mode) or (self._was_armed and not self.is_armed):
                self.was_taken = True
            self._was_in_mode, self._was_armed = self.is_in_mode, self.is_armed
            return True
        if kind == "ATTITUDE":
            self._attitude = message
        elif kind == "LOCAL_POSITION_NED" and self._attitude is not None:
            try:
                self.telemetry = telemetry(self._attitude, message, now_s)
            except ValueError:
                self.malformed += 1
        elif kind == "COMMAND_ACK" and message.result not in (_ACCEPTED, _IN_PROGRESS):
            self.refusals += 1
            asked = _REQUESTS.get(message.command, f"command {message.command}")
            self.last_refusal = f"it refused {asked} with result {message.result}"
        elif kind == "STATUSTEXT" and message.severity <= _WARNING:
            self.alarms += 1
            self.last_alarm = _printable(message.text)
        return False


def _printable(text: str | bytes) -> str:
    text = text.decode("ascii", "replace") if isinstance(text, bytes) else text
    return "".join(letter if letter.isascii() and letter.isprintable() else "?" for letter in text)
