import sys
import threading
import tomllib
from pathlib import Path

import pytest

from hil.vehicles.mavlink_vehicle import MavlinkVehicle
from mtm_onboard.links.base import TakenOverError
from mtm_onboard.links.factory import make_link
from mtm_onboard.links.mavlink import MavlinkLink
from mtm_onboard.links.mavlink_codec import MavlinkCodec
from mtm_onboard.links.mavlink_messages import velocity_setpoint
from mtm_onboard.links.mavlink_ports import UdpPort
from mtm_onboard.links.mavlink_profiles import PROFILES
from mtm_onboard.model.clock import SystemClock
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from mtm_onboard.runtime.loop import run_loop
from mtm_onboard.runtime.service import ServiceThread
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.links.conformance import LinkConformance
from tests.onboard.links.mavlink_rig import FIRMWARES, line_rig, mavlink_rig
from tests.onboard.links.mavlink_spec import read_frames
from tests.patience import PATIENCE_S

FORWARD = BodyVelocity(0.5, 0.0, 0.0)
SET_MODE, ARM = 176, 400
EXAMPLE = Path(__file__).parents[3] / "examples/robots/mavlink.toml"


class TestMavlinkCopterConforms(LinkConformance):
    @pytest.fixture
    def rig(self):
        return mavlink_rig("copter", vehicle={"goes_on": True})


class TestMavlinkOverALineConforms(LinkConformance):
    @pytest.fixture
    def rig(self):
        with line_rig("copter", vehicle={"goes_on": True}) as rig:
            yield rig


class TestMavlinkPx4Conforms(LinkConformance):
    @pytest.fixture
    def rig(self):
        return mavlink_rig("px4", vehicle={"goes_on": True})


class TestMavlinkRoverConforms(LinkConformance):
    askew = BodyVelocity(0.5, 0.0, 0.25)
    other = BodyVelocity(-0.5, 0.0, 0.5)

    @pytest.fixture
    def rig(self):
        return mavlink_rig("rover", vehicle={"goes_on": True})

    def test_positive_vy_drives_to_the_left(self, rig):
        """A rover cannot, and says so instead of dropping a part of the motion."""
        with rig.transport:
            before = rig.wire_bytes()
            with pytest.raises(ValueError, match="cannot move sideways, and 0.5 m/s"):
                rig.transport.send(BodyVelocity(0.0, 0.5, 0.0))
            assert rig.wire_bytes() == before
        assert rig.plant.position_xy_m == (0.0, 0.0)


def names(frames, key=None):
    return [frame.name for frame in read_frames(b"".join(frames), key)]


def refusal_of(rig, moved=False):
    with pytest.raises(MtmError) as caught:
        rig.transport.open()
    text = str(caught.value)
    assert text.endswith(".")
    assert moved or all(velocity == STOP for _, velocity in rig.plant.commands)
    return text


@pytest.mark.parametrize("profile", ["rover", "copter", "px4"])
def test_a_vehicle_in_another_mode_is_left_there(profile):
    rig = mavlink_rig(profile, set_mode=False, vehicle={"is_guided": False})
    mode = rig.vehicle.mode
    assert f"(its mode is {mode}); switch it over, or allow that with set_mode = true" in refusal_of(rig)
    assert rig.vehicle.requests == []
    assert rig.vehicle.mode == mode
    assert rig.clock.now() == pytest.approx(10.0, abs=0.1)


def test_a_disarmed_vehicle_is_left_so_and_open_says_what_to_do():
    rig = mavlink_rig(vehicle={"is_armed": False}, set_mode=True, open_timeout_s=2.0)
    assert refusal_of(rig) == "The vehicle is not armed; arm it, or allow that with arm = true."
    assert rig.vehicle.requests == []
    assert not rig.vehicle.is_armed
    assert rig.clock.now() == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("profile", ["rover", "copter", "px4"])
def test_mode_and_arming_are_asked_for_in_this_order(profile):
    rig = mavlink_rig(profile, set_mode=True, arm=True, vehicle={"is_guided": False, "is_armed": False})
    with rig.transport:
        assert rig.vehicle.is_obeying
        assert rig.vehicle.requests[0] == SET_MODE
        assert rig.vehicle.requests[-1] == ARM
        assert rig.transport.health()["refusals"] == 0
        rig.drive(FORWARD)
        assert rig.plant.velocity_body == FORWARD


def test_the_pilot_may_hand_the_vehicle_over_while_open_waits():
    rig = mavlink_rig(vehicle={"is_guided": False})
    rig.clock.every(100.0, lambda _: rig.vehicle.pilot_switches(rig.vehicle.firmware.guided_mode), first_s=4.0)
    with rig.transport:
        assert 4.0 <= rig.clock.now() <= 5.1
    assert rig.vehicle.requests == []


def test_a_refused_request_is_counted_with_its_reason():
    rig = mavlink_rig(arm=True, vehicle={"is_armed": False, "can_arm": False})
    text = refusal_of(rig)
    assert "it refused arming with result 4; Arm: checks failed" in text
    health = rig.transport.health()
    assert health["refusals"] == health["alarms"] == rig.vehicle.requests.count(ARM) > 5
    assert health["last_alarm"] == "Arm: checks failed"


def test_px4_hears_zero_set_points_before_offboard():
    rig = mavlink_rig("px4")
    with rig.transport:
        kinds = names(rig.wire.frames)
        first = kinds.index("COMMAND_LONG")
        assert kinds[:first].count("SET_POSITION_TARGET_LOCAL_NED") > 50
        assert rig.vehicle.requests == [SET_MODE]
        assert rig.transport.health()["refusals"] == 0


@pytest.mark.parametrize(("profile", "other"), [("copter", "rover"), ("rover", "copter"), ("copter", "px4")])
def test_a_vehicle_of_another_kind_is_refused_at_once(profile, other):
    rig = mavlink_rig(profile, vehicle={"is_guided": True})
    rig.vehicle.firmware = FIRMWARES[other]
    assert f"which is no {profile}; choose the profile" in refusal_of(rig)
    assert rig.clock.now() < 0.1


def test_a_silent_wire_is_refused_in_time():
    rig = mavlink_rig(open_timeout_s=3.0, endpoint="udpin:0.0.0.0:14550")
    rig.wire.port.is_cut = True
    rig.clock.every(100.0, lambda _: setattr(rig.wire.port, "is_cut", False), first_s=50.0)
    assert "No heartbeat of system 1 came over udpin:0.0.0.0:14550 in 3 s" in refusal_of(rig)


@pytest.mark.parametrize(("system", "component"), [(2, 1), (1, 154), (255, 190)])
def test_heartbeats_of_others_say_nothing_of_the_vehicle(system, component):
    rig = mavlink_rig()
    other = MavlinkCodec(system, component)
    with rig.transport:
        rig.vehicle._port.write(other.encode(other.messages.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)))
        rig.run(0.05)
        rig.drive(FORWARD)
        assert rig.transport.health()["taken_over"] is False


@pytest.mark.parametrize("profile", ["rover", "copter", "px4"])
@pytest.mark.parametrize("way", ["switches", "disarms"])
def test_a_pilot_who_takes_over_is_never_fought(profile, way):
    rig = mavlink_rig(profile)
    with rig.transport:
        rig.drive(FORWARD)
        if way == "switches":
            rig.vehicle.pilot_switches(rig.vehicle.firmware.other_mode)
        else:
            rig.vehicle.pilot_disarms()
        with pytest.raises(TakenOverError, match="somebody has taken it over"):
            rig.drive(FORWARD, 1.1)
        requests, written = list(rig.vehicle.requests), len(rig.wire.frames)
        for _ in range(50):
            with pytest.raises(TakenOverError, match="taken it over"):
                rig.transport.send(FORWARD)
            rig.run(0.02)
        rig.transport.stop()
        rig.vehicle.pilot_switches(rig.vehicle.firmware.guided_mode)
        rig.run(1.5)
        with pytest.raises(TakenOverError, match="taken it over"):
            rig.transport.send(FORWARD)
        assert rig.transport.health()["taken_over"] is True
    assert set(names(rig.wire.frames[written:])) == {"HEARTBEAT"}
    assert rig.vehicle.requests == requests
    assert rig.plant.velocity_body == STOP


@pytest.mark.parametrize("way", ["switches", "disarms"])
def test_a_pilot_is_not_fought_while_opening_either(way):
    """The vehicle was armed or in its mode, and lacks the other, when the pilot acts."""
    rig = mavlink_rig(
        set_mode=True, arm=True, vehicle={"is_guided": False, "is_armed": way == "disarms", "can_arm": False}
    )
    if way == "disarms":
        rig.vehicle._codec.decode = lambda _: []  # it hears no request, and stays out of its mode

    def act(_now_s):
        if way == "disarms":
            rig.vehicle.pilot_disarms()
        else:
            rig.vehicle.pilot_switches(rig.vehicle.firmware.other_mode)

    rig.clock.every(100.0, act, first_s=3.0)
    asked = []
    rig.clock.every(100.0, lambda _: asked.extend(rig.vehicle.requests), first_s=4.01)
    with pytest.raises(TakenOverError, match="somebody has taken it over"):
        rig.transport.open()
    rig.run(5.0)
    assert rig.vehicle.requests == asked
    assert not rig.vehicle.is_obeying


def test_after_a_takeover_only_opening_anew_drives_again():
    rig = mavlink_rig()
    with rig.transport:
        rig.vehicle.pilot_switches(rig.vehicle.firmware.other_mode)
        rig.run(1.1)
        rig.vehicle.pilot_switches(rig.vehicle.firmware.guided_mode)
        rig.transport.open()
        rig.drive(FORWARD)
        assert rig.plant.velocity_body == FORWARD
        assert rig.transport.health()["taken_over"] is False


def test_opening_anew_goes_by_what_the_vehicle_says_then():
    rig = mavlink_rig(open_timeout_s=1.5)
    with rig.transport:
        rig.drive(FORWARD)
        rig.transport.stop()
        rig.vehicle.pilot_switches(rig.vehicle.firmware.other_mode)
        assert rig.transport.health()["mode"] == rig.vehicle.firmware.guided_mode
        assert "is not in GUIDED" in refusal_of(rig, moved=True)


def test_opening_brings_a_moving_vehicle_to_a_stand():
    rig = mavlink_rig(vehicle={"goes_on": True})
    other = MavlinkCodec(1, 190)
    rig.wire.port.write(other.encode(velocity_setpoint(other.messages, PROFILES["copter"], 1, FORWARD, 0.0)))
    rig.run(0.01)
    assert rig.plant.velocity_body == FORWARD
    with rig.transport:
        rig.run(0.02)
        assert rig.plant.velocity_body == STOP


def test_stopping_and_closing_leave_arming_and_mode():
    rig = mavlink_rig()
    with rig.transport:
        rig.drive(FORWARD)
    rig.run(5.0)
    assert rig.vehicle.is_obeying
    assert rig.vehicle.requests == []
    assert rig.plant.velocity_body == STOP


def test_a_vehicle_that_falls_silent_is_not_driven_on():
    rig = mavlink_rig()
    with rig.transport:
        rig.drive(FORWARD)
        rig.vehicle._port.is_cut = True
        began_s = rig.clock.now()
        assert rig.transport.degraded == ""
        rig.drive(FORWARD, 2.0)
        assert rig.transport.degraded == "the vehicle's heartbeat is late"
        with pytest.raises(MtmError, match="last heard 3.5 s ago"):
            rig.drive(FORWARD, 10.0)
        assert 2.4 < rig.clock.now() - began_s < 3.6


def test_a_heartbeat_goes_out_each_second():
    rig = mavlink_rig()
    with rig.transport:
        before = len(rig.wire.frames)
        rig.drive(FORWARD, 10.0)
        sent = names(rig.wire.frames[before:])
        assert sent.count("SET_POSITION_TARGET_LOCAL_NED") == 500
        assert sent.count("HEARTBEAT") == 10
        assert rig.vehicle.companion_heartbeats == rig.transport.heartbeats


@pytest.mark.parametrize("profile", ["copter", "px4"])
def test_telemetry_is_that_of_the_plant(profile):
    rig = mavlink_rig(profile)
    with rig.transport:
        assert rig.transport.telemetry is None or rig.transport.telemetry.velocity_body_mps == (0.0, 0.0)
        rig.drive(BodyVelocity(0.25, 0.5, 0.5), 2.0)
        told = rig.transport.telemetry
        assert rig.clock.now() - told.received_s <= 0.11
        assert told.received_s - told.robot_time_s == pytest.approx(0.0, abs=0.02)
        assert told.velocity_body_mps == pytest.approx((0.25, 0.5), abs=1e-6)
        assert told.turn_rate_radps == 0.5
        assert told.heading_rad == pytest.approx(rig.plant.heading_rad, abs=0.06)
        assert told.position_xy_m == pytest.approx(rig.plant.position_xy_m, abs=0.07)


def test_a_first_heartbeat_of_a_vehicle_not_ready_is_no_takeover():
    rig = mavlink_rig(set_mode=True, arm=True, vehicle={"is_guided": False, "is_armed": False})
    with rig.transport:
        assert rig.transport.health()["taken_over"] is False


def test_alarms_are_counted_and_mere_information_is_not():
    rig = mavlink_rig()
    with rig.transport:
        for severity, text in ((6, "hello"), (4, "low battery"), (1, "really\x07low")):
            rig.vehicle.say(severity, text)
        rig.run(0.05)
        health = rig.transport.health()
        assert (health["alarms"], health["last_alarm"]) == (2, "really?low")


def test_a_cut_wire_is_one_sentence_and_counted():
    rig = mavlink_rig()
    rig.transport.open()
    rig.wire.port.is_cut = True
    with pytest.raises(MtmError, match="the wire is cut"):
        rig.transport.send(FORWARD)
    assert rig.transport.health()["link_errors"] == 1
    with pytest.raises(MtmError, match="take the vehicle over by remote control"):
        rig.transport.stop()
    rig.transport.close()


def test_a_stop_is_repeated_against_a_lost_datagram():
    rig = mavlink_rig(vehicle={"goes_on": True})
    with rig.transport:
        rig.drive(FORWARD)
        lost = rig.vehicle._port
        rig.clock.every(100.0, lambda _: lost._inbox.clear(), first_s=rig.clock.now() + 0.005)
    rig.settle()
    assert rig.plant.velocity_body == STOP


@pytest.mark.parametrize(("profile", "seconds"), [("rover", 3.0), ("copter", 3.0), ("px4", 1.0)])
def test_a_vehicle_that_hears_no_set_point_stops_by_itself(profile, seconds):
    rig = mavlink_rig(profile)
    with rig.transport:
        rig.drive(FORWARD)
        rig.run(seconds - 0.1)
        assert rig.plant.velocity_body == FORWARD
        rig.run(0.2)
        assert rig.plant.velocity_body == STOP


def test_px4_out_of_offboard_without_set_points_is_taken_over():
    rig = mavlink_rig("px4")
    with rig.transport:
        rig.drive(FORWARD)
        rig.run(2.5)
        assert rig.vehicle.losses == 1
        with pytest.raises(MtmError, match="left OFFBOARD"):
            rig.transport.send(FORWARD)


@pytest.fixture
def hasty_threads():
    """Threads that take turns after a microsecond."""
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before_s)


def test_two_threads_never_share_a_number(hasty_threads):
    rig = mavlink_rig()
    with rig.transport:
        before = len(rig.wire.frames)
        beating = threading.Thread(target=lambda: [rig.transport.service(10.0 + beat) for beat in range(300)])
        beating.start()
        for _ in range(300):
            rig.transport.send(FORWARD)
        beating.join()
        frames = read_frames(b"".join(rig.wire.frames))
    assert len(rig.wire.frames) - before >= 600
    assert [frame.sequence for frame in frames] == [number % 256 for number in range(len(frames))]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"endpoint": 14550}, "give text in quotes"),
        ({"profile": "boat"}, "choose one of: rover, copter, px4"),
        ({"arm": "no"}, "arm is 'no'; give true or false"),
        ({"set_mode": 1}, "set_mode is 1; give true or false"),
        ({"target_system": 0}, "1 to 255"),
        ({"target_system": True}, "1 to 255"),
        ({"open_timeout_s": 0}, "above zero"),
        ({"open_timeout_s": "10"}, "above zero"),
    ],
)
def test_options_that_make_no_sense_are_refused_in_one_sentence(options, sentence):
    with pytest.raises(MtmError, match=sentence):
        MavlinkLink(**({"endpoint": "udpin:0.0.0.0:14550", "profile": "copter"} | options))


def test_the_configuration_s_kind_makes_it():
    transport = make_link("mavlink", {"endpoint": "udpin:127.0.0.1:14550", "profile": "px4", "set_mode": True})
    assert isinstance(transport, MavlinkLink)
    with pytest.raises(MtmError, match="does not take these options"):
        make_link("mavlink", {"endpoint": "udpin:127.0.0.1:14550", "profile": "px4", "set_modes": True})


def test_the_documented_options_are_those_it_takes(tmp_path):
    text = EXAMPLE.read_text(encoding="utf-8")
    lines = text[text.index('kind = "mavlink"') : text.index("[limits]")].splitlines()
    options = tomllib.loads("\n".join(line.removeprefix("# ") for line in lines))
    key_file = tmp_path / options["signing_key_file"]
    key_file.touch(0o600)
    key_file.write_text("00" * 32)
    transport = make_link(options.pop("kind"), options | {"signing_key_file": str(key_file)})
    assert isinstance(transport, MavlinkLink)
    assert {"set_mode": False, "arm": False, "target_system": 1, "open_timeout_s": 10.0}.items() <= options.items()


def test_a_missing_library_is_one_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymavlink.dialects.v20", None)
    with pytest.raises(MtmError, match=r"install it with: pip install .*\[mavlink\]"):
        MavlinkLink("udpin:127.0.0.1:14550", profile="copter")


@pytest.mark.realtime
def test_a_vehicle_is_driven_over_udp_in_real_time():
    there, plant = UdpPort(listen=("127.0.0.1", 0)), FloatingPlant()
    vehicle = MavlinkVehicle(FIRMWARES["px4"], plant, there)
    clock, ended = SystemClock(), threading.Event()
    began_s = clock.now()

    def poll(_tick, now_s, _late_s):
        vehicle.poll(now_s - began_s)

    far_end = threading.Thread(
        target=run_loop, args=(clock, 100.0, poll), kwargs=dict(start_s=began_s, stop=ended.is_set)
    )
    far_end.start()
    transport = MavlinkLink(f"udpout:127.0.0.1:{there.number}", profile="px4", set_mode=True, arm=True)
    try:
        with transport, ServiceThread(transport, clock) as service:
            start_s, before = clock.now(), transport.health()["setpoints"]

            def step(_tick, _now_s, _late_s):
                transport.send(BodyVelocity(0.5, 0.25, 0.0))

            def arrived():
                return plant.position_xy_m[0] > 0.5 or clock.now() > start_s + PATIENCE_S

            ticks = run_loop(clock, 50.0, step, start_s=start_s, stop=arrived).sent
            assert service.error is None
            telemetry, health = transport.telemetry, transport.health()
        x_m, y_m = plant.position_xy_m
        assert telemetry.velocity_body_mps == (0.5, 0.25)
        assert x_m > 0.5
        assert y_m == pytest.approx(x_m / 2.0)
        # This profile takes set-points for a second before it may be driven.
        assert before > 40
        assert health["setpoints"] == before + ticks
        assert health["link_errors"] == health["bad_frames"] == health["refusals"] == 0
        ended.set()
        far_end.join()
        vehicle.poll(clock.now() - began_s)
        assert plant.velocity_body == STOP
    finally:
        ended.set()
        far_end.join()
        there.close()
