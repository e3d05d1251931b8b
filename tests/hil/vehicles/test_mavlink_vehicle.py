import math

import pytest

from hil.plants.unicycle import UnicyclePlant
from hil.vehicles.mavlink_firmware import COPTER, PX4, ROVER
from hil.vehicles.mavlink_vehicle import MavlinkVehicle
from hil.wires.byte_pipe import byte_pipe
from mtm_onboard.links.mavlink_codec import MavlinkCodec
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from tests.hil.vehicles.floating_plant import FloatingPlant

FIRMWARES = {"copter": COPTER, "rover": ROVER, "px4": PX4}
MASKS = {"copter": 0x05C7, "rover": 0x05E7, "px4": 0x05C7}
SET_MODE, ARM = 176, 400
ACCEPTED, REJECTED_FOR_NOW, UNSUPPORTED, FAILED = 0, 1, 3, 4


class Companion:
    """What talks to the vehicle in these tests, field by field."""

    def __init__(self, name="copter", **options):
        ours, theirs = byte_pipe()
        self.port = ours
        self.plant = FloatingPlant()
        self.name, self.firmware = name, FIRMWARES[name]
        self.vehicle = MavlinkVehicle(self.firmware, self.plant, theirs, **options)
        self.codec = MavlinkCodec(1, 191)
        self.messages = self.codec.messages
        self.now_s = 0.0

    def run(self, seconds=0.02, step_s=0.01):
        end_s = self.now_s + seconds
        while self.now_s < end_s - 1e-9:
            self.now_s += step_s
            self.vehicle.poll(self.now_s)

    def setpoint(self, vx=0.0, vy=0.0, vz=0.0, yaw_rate=0.0, mask=None, frame=8, system=1, component=1):
        message = self.messages.MAVLink_set_position_target_local_ned_message(
            0, system, component, frame, MASKS[self.name] if mask is None else mask,
            9.0, 9.0, 9.0, vx, vy, vz, 9.0, 9.0, 9.0, 9.0, yaw_rate,
        )  # fmt: skip
        self.port.write(self.codec.encode(message))
        self.run()
        return self.plant.velocity_body

    def ask(self, command, *parameters, system=1):
        padded = (*parameters, *[0.0] * (7 - len(parameters)))
        self.port.write(self.codec.encode(self.messages.MAVLink_command_long_message(system, 1, command, 0, *padded)))
        self.heard()
        self.run()
        return [message.result for message in self.heard("COMMAND_ACK")]

    def heard(self, kind=None):
        found = []
        while data := self.port.read():
            found += self.codec.decode(data)
        return [message for message in found if kind in (None, message.get_type())]


@pytest.fixture(params=FIRMWARES)
def ready(request):
    """A companion whose vehicle is in its mode, armed, and has just heard a set-point."""
    companion = Companion(request.param, is_guided=True, is_armed=True)
    companion.setpoint()
    assert companion.vehicle.is_obeying
    return companion


def test_ahead_and_clockwise_are_obeyed_in_rep_103(ready):
    assert ready.setpoint(vx=0.5, yaw_rate=0.25) == BodyVelocity(0.5, 0.0, -0.25)
    assert ready.setpoint(vx=-0.5) == BodyVelocity(-0.5, 0.0, 0.0)


@pytest.mark.parametrize("name", ["copter", "px4"])
def test_a_copter_goes_to_the_right_and_a_rover_only_faster(name):
    copter = Companion(name, is_guided=True, is_armed=True)
    assert copter.setpoint(vx=0.5, vy=0.25) == BodyVelocity(0.5, -0.25, 0.0)
    rover = Companion("rover", is_guided=True, is_armed=True)
    assert rover.setpoint(vx=-0.3, vy=0.4) == pytest.approx((-0.5, 0.0, 0.0))


@pytest.mark.parametrize("name", ["copter", "px4"])
def test_a_local_velocity_is_towards_north_and_east(name):
    companion = Companion(name, is_guided=True, is_armed=True)
    for _ in range(50):
        companion.setpoint(yaw_rate=-1.0)
    heading_rad = companion.plant.heading_rad
    assert heading_rad > 0.9
    ahead, left, _ = companion.setpoint(vx=1.0, frame=1)
    heading_rad = companion.plant.heading_rad
    assert (ahead, left) == pytest.approx((math.cos(heading_rad), -math.sin(heading_rad)), abs=0.03)


@pytest.mark.parametrize(
    "change",
    [
        {"mask": 0}, {"mask": 0x0FFF}, {"mask": 0x05C0}, {"mask": 0x0407}, {"mask": 0x01C7},
        {"mask": 0x0407 | 0x0200}, {"mask": 0x05CF}, {"mask": 0x05D7},
        {"frame": 0}, {"frame": 3}, {"frame": 12}, {"frame": 255},
        {"vx": math.nan}, {"yaw_rate": math.inf}, {"vz": math.nan, "mask": 0x05C7},
    ],
    ids=str,
)  # fmt: skip
def test_what_a_real_one_ignores_is_ignored_and_counted(ready, change):
    before = ready.vehicle.setpoints
    assert ready.setpoint(**({"vx": 0.5} | change)) == STOP
    assert (ready.vehicle.setpoints, ready.vehicle.ignored_setpoints) == (before, 1)
    assert ready.vehicle.controller.faults == 0


@pytest.mark.parametrize("name", ["copter", "px4"])
def test_a_velocity_without_a_yaw_rate_turns_nothing(name):
    companion = Companion(name, is_guided=True, is_armed=True)
    assert companion.setpoint(vx=0.5, vy=0.25, yaw_rate=math.nan, mask=0x0DC7) == BodyVelocity(0.5, -0.25, 0.0)


@pytest.mark.parametrize("mask", [0x0FC7, 0x0DE7])
def test_a_rover_that_is_told_a_velocity_alone_steers_towards_it(mask):
    companion = Companion("rover", is_guided=True, is_armed=True)
    speed_mps, _, turn_radps = companion.setpoint(vx=0.4, vy=0.3, mask=mask)
    assert speed_mps == pytest.approx(0.5)
    assert turn_radps < -0.5  # to the right
    assert companion.setpoint(vx=0.5, mask=mask) == BodyVelocity(0.5, 0.0, 0.0)


def test_ardupilot_s_force_bit_counts_with_accelerations_only():
    assert Companion("copter", is_guided=True, is_armed=True).setpoint(vx=0.5, mask=0x0FC7).vx_mps == 0.5
    assert Companion("px4", is_guided=True, is_armed=True).setpoint(vx=0.5, mask=0x0FC7) == STOP


def test_arming_and_modes_are_obeyed_with_nan_behind_them():
    companion = Companion("rover")
    assert companion.ask(SET_MODE, 1.0, 15.0, *[math.nan] * 5) == [ACCEPTED]
    assert companion.ask(ARM, 1.0, *[math.nan] * 6) == [ACCEPTED]
    assert companion.vehicle.is_obeying


@pytest.mark.parametrize("name", FIRMWARES)
def test_parameters_are_told_to_whoever_asks(name):
    companion = Companion(name)
    messages = companion.messages
    companion.port.write(companion.codec.encode(messages.MAVLink_param_request_list_message(1, 1)))
    companion.run()
    told = companion.heard("PARAM_VALUE")
    assert [one.param_index for one in told] == list(range(told[0].param_count))
    assert len({one.param_id for one in told}) == len(told) >= 2
    for wanted in (told[1].param_id.encode(), 1), (told[1].param_id.encode(), -1), (b"", 1):
        companion.port.write(companion.codec.encode(messages.MAVLink_param_request_read_message(1, 1, *wanted)))
        companion.run()
        (one,) = companion.heard("PARAM_VALUE")
        assert (one.param_id, one.param_value) == (told[1].param_id, told[1].param_value)
    companion.port.write(companion.codec.encode(messages.MAVLink_param_request_read_message(1, 1, b"NO_SUCH", -1)))
    companion.run()
    assert companion.heard("PARAM_VALUE") == []


def test_offset_frames_are_arducopters_and_not_px4s():
    assert Companion("copter", is_guided=True, is_armed=True).setpoint(vx=0.5, frame=9).vx_mps == 0.5
    assert Companion("px4", is_guided=True, is_armed=True).setpoint(vx=0.5, frame=9) == STOP


@pytest.mark.parametrize("target", [{"system": 2}, {"system": 255}, {"component": 154}])
def test_what_is_meant_for_others_is_left_to_them(ready, target):
    assert ready.setpoint(vx=0.5, **target) == STOP
    assert ready.setpoint(vx=0.5, system=0, component=0).vx_mps == 0.5


@pytest.mark.parametrize("state", [{"is_guided": False}, {"is_armed": False}])
@pytest.mark.parametrize("name", FIRMWARES)
def test_set_points_move_nothing_outside_the_mode_or_disarmed(name, state):
    companion = Companion(name, **({"is_guided": True, "is_armed": True} | state))
    assert companion.setpoint(vx=0.5) == STOP
    assert companion.vehicle.setpoints == 1


@pytest.mark.parametrize(("name", "seconds"), [("copter", 3.0), ("rover", 3.0), ("px4", 1.0)])
def test_a_vehicle_stops_when_set_points_cease(name, seconds):
    companion = Companion(name, is_guided=True, is_armed=True)
    companion.setpoint(vx=0.5)
    companion.run(seconds - 0.05)
    assert companion.plant.velocity_body.vx_mps == 0.5
    companion.run(0.1)
    assert companion.plant.velocity_body == STOP
    assert companion.vehicle.is_obeying is (name != "px4")
    assert companion.vehicle.losses == (name == "px4")
    moved = companion.setpoint(vx=0.5)
    assert moved == (STOP if name == "px4" else BodyVelocity(0.5, 0.0, 0.0))


@pytest.mark.parametrize(("gap_s", "answer"), [(0.02, ACCEPTED), (0.4, ACCEPTED), (0.6, REJECTED_FOR_NOW)])
def test_px4_is_put_into_offboard_only_by_a_stream_of_set_points(gap_s, answer):
    companion = Companion("px4", is_armed=True)
    assert companion.ask(SET_MODE, 1.0, 6.0) == [REJECTED_FOR_NOW]
    for _ in range(math.ceil(1.3 / gap_s)):
        companion.setpoint()
        companion.run(gap_s - 0.02)
    companion.setpoint()
    assert companion.ask(SET_MODE, 1.0, 6.0) == [answer]
    assert companion.vehicle.is_obeying is (answer == ACCEPTED)


def test_a_stream_that_has_only_begun_is_not_enough():
    companion = Companion("px4", is_armed=True)
    for _ in range(45):
        companion.setpoint()
    assert companion.ask(SET_MODE, 1.0, 6.0) == [REJECTED_FOR_NOW]


def test_a_stream_that_has_ended_is_not_enough():
    companion = Companion("px4", is_armed=True)
    for _ in range(60):
        companion.setpoint()
    companion.run(0.5)
    assert companion.ask(SET_MODE, 1.0, 6.0) == [REJECTED_FOR_NOW]


@pytest.mark.parametrize(("name", "number"), [("copter", 4.0), ("rover", 15.0)])
def test_ardupilot_changes_modes_and_arms_when_its_checks_pass(name, number):
    companion = Companion(name)
    assert companion.ask(SET_MODE, 1.0, number) == [ACCEPTED]
    assert companion.ask(ARM, 1.0) == [ACCEPTED]
    assert companion.vehicle.is_obeying
    assert companion.ask(ARM, 0.0) == [ACCEPTED]
    assert not companion.vehicle.is_obeying


def test_checks_that_fail_are_said_in_a_text():
    companion = Companion(is_guided=True, can_arm=False)
    companion.port.write(
        companion.codec.encode(companion.messages.MAVLink_command_long_message(1, 1, ARM, 0, 1, 0, 0, 0, 0, 0, 0))
    )
    companion.run()
    heard = companion.heard()
    assert [message.text for message in heard if message.get_type() == "STATUSTEXT"] == ["Arm: checks failed"]
    assert [message.result for message in heard if message.get_type() == "COMMAND_ACK"] == [FAILED]
    assert not companion.vehicle.is_armed


@pytest.mark.parametrize(
    ("request_", "answer"),
    [((22, 1.0), UNSUPPORTED), ((SET_MODE, 0.0, 4.0), UNSUPPORTED), ((SET_MODE, 1.0, math.nan), FAILED),
     ((SET_MODE, 1.0, -1.0), FAILED), ((ARM, math.inf), FAILED)],
)  # fmt: skip
def test_requests_that_make_no_sense_change_nothing(request_, answer):
    companion = Companion()
    mode = companion.vehicle.mode
    assert companion.ask(*request_) == [answer]
    assert (companion.vehicle.mode, companion.vehicle.is_armed) == (mode, False)
    assert companion.ask(*request_, system=9) == []


def test_it_says_what_it_is_each_second_and_moves_ten_times():
    companion = Companion("rover", is_guided=True)
    companion.run(5.0)
    heard = companion.heard()
    beats = [message for message in heard if message.get_type() == "HEARTBEAT"]
    assert len(beats) == 6
    assert {(beat.autopilot, beat.type, beat.custom_mode, beat.base_mode) for beat in beats} == {(3, 10, 15, 1)}
    for kind in ("ATTITUDE", "LOCAL_POSITION_NED"):
        assert sum(message.get_type() == kind for message in heard) == 51


def test_motion_is_told_north_east_down():
    companion = Companion(is_guided=True, is_armed=True)
    companion.setpoint(vx=1.0, vy=-0.5, yaw_rate=-0.5)
    companion.run(1.2)
    heard = companion.heard()
    attitude = [message for message in heard if message.get_type() == "ATTITUDE"][-1]
    position = [message for message in heard if message.get_type() == "LOCAL_POSITION_NED"][-1]
    heading_rad = -attitude.yaw
    assert attitude.yawspeed == -0.5
    assert position.vx == pytest.approx(math.cos(heading_rad) - 0.5 * math.sin(heading_rad), abs=1e-6)
    assert -position.vy == pytest.approx(math.sin(heading_rad) + 0.5 * math.cos(heading_rad), abs=1e-6)
    assert (position.x, -position.y) == pytest.approx(companion.plant.position_xy_m, abs=0.05)


def test_a_broken_wire_is_counted_and_harms_nothing():
    class Broken:
        def write(self, frame):
            raise MtmError("broken")

        def read(self):
            raise MtmError("broken")

    vehicle = MavlinkVehicle(COPTER, FloatingPlant(), Broken(), is_guided=True, is_armed=True)
    vehicle.poll(0.0)
    assert vehicle.port_errors == 4


def test_a_cut_pipe_carries_nothing_and_counts_what_it_carried():
    ours, theirs = byte_pipe()
    ours.write(b"abc")
    assert (ours.sent, theirs.read(), theirs.read()) == (3, b"abc", b"")
    ours.is_cut = True
    with pytest.raises(MtmError, match="cut"):
        ours.write(b"d")
    theirs.write(b"e")
    assert ours.read() == b""


def test_a_unicycle_follows_with_its_lag_and_never_sideways():
    plant = UnicyclePlant(lag_s=0.5, heading_rad=math.pi / 2)
    plant.command(0.0, BodyVelocity(1.0, 5.0, 0.0))
    for step in range(1, 301):
        plant.step(0.01 * step)
    assert plant.velocity_body.vx_mps == pytest.approx(1.0 - math.exp(-6.0))
    assert plant.velocity_body.vy_mps == 0.0
    # A first-order lag loses its time constant on the way.
    assert plant.position_xy_m == pytest.approx((0.0, 3.0 - 0.5 * (1.0 - math.exp(-6.0))), abs=1e-9)


def test_a_unicycle_without_a_lag_drives_a_circle():
    plant = UnicyclePlant()
    plant.command(0.0, BodyVelocity(1.0, 0.0, math.tau))
    for step in range(1, 1001):
        plant.step(0.001 * step)
        plant.step(0.001 * step)
    assert plant.heading_rad == pytest.approx(math.tau)
    assert plant.position_xy_m == pytest.approx((0.0, 0.0), abs=1e-9)
