import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.vehicles.motion_controller import MotionController
from hil.vehicles.plaintext_node import MOST_QUEUED, PlaintextMotionController
from mtm_onboard.model.velocity import STOP, BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant


class Wire:
    """A port in memory: what is put in `arriving` is received, None being the client's end."""

    def __init__(self):
        self.arriving = []
        self.said = b""
        self.pushed = []
        self.is_shut_down = False

    def receive(self):
        return self.arriving.pop(0) if self.arriving else b""

    def answer(self, text):
        self.said += text

    def push(self, text):
        self.pushed.append(text)

    def shutdown(self):
        self.is_shut_down = True


class Robot:
    def __init__(self, ports=1, **options):
        self.plant = FloatingPlant()
        self.controller = MotionController(self.plant, deadman_s=None)
        self.wires = [Wire() for _ in range(ports)]
        self.node = PlaintextMotionController(self.controller, self.wires, **options)
        self.now_s = 0.0

    def say(self, text, wire=0):
        """Send `text`, let the robot act, and return what it answers."""
        said = len(self.wires[wire].said)
        self.wires[wire].arriving.append(text if isinstance(text, bytes) else text.encode())
        self.run(0.01)
        return self.wires[wire].said[said:].decode()

    def run(self, seconds):
        for _ in range(round(seconds / 0.01)):
            self.now_s = round(self.now_s + 0.01, 6)
            self.node.poll(self.now_s)


@pytest.fixture
def robot():
    robot = Robot()
    assert robot.say("command;") == "ok;"
    return robot


def test_a_robot_is_silent_before_command_and_does_nothing():
    robot = Robot()
    assert robot.say("version;chassis speed x 1 y 0 z 0;quit;robot mode ?;nonsense;commands;command x;") == ""
    assert robot.plant.velocity_body == STOP
    assert not robot.controller.work_mode
    assert robot.node.unheard == 7


def test_command_engages_the_motors_and_a_second_one_says_so(robot):
    assert robot.controller.work_mode
    assert robot.say("command;") == "Already in SDK mode;"


def test_quit_stops_releases_and_falls_silent(robot):
    robot.say("chassis speed x 0.5;")
    assert robot.plant.velocity_body != STOP
    assert robot.say("quit;") == "ok;"
    assert robot.plant.velocity_body == STOP
    assert not robot.controller.work_mode
    assert robot.say("quit;version;") == ""


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        ("version;", "version 00.00.00.00;"),
        ("robot battery ?;", "84 ;"),
        ("robot mode ?;", "chassis_lead ;"),
        ("robot mode free;", "ok;"),
        ("chassis speed x 0.1 y 0 z 0;", "ok;"),
        ("chassis speed x 0.1 y 0 z 0 seq 5;", "ok seq 5;"),
        ("chassis speed z -600 seq 0x1F;", "ok seq 0x1F;"),
        ("chassis wheel w1 0 w2 0 w3 0 w4 0;", "ok;"),
        ("chassis speed ?;", "0.000 0.000 0.000 0 0 0 0 ;"),
        ("chassis position ?;", "0.000 0.000 0.000 ;"),
        ("chassis attitude ? seq 9;", "0.000 0.000 0.000  seq 9;"),
        ("chassis status ?;", "1 0 0 0 0 0 0 0 0 0 0 ;"),
        ("chassis push position on pfreq 50 attitude on afreq 50 status on sfreq 10;", "ok;"),
        ("chassis push freq 20 position on;", "ok;"),
        ("chassis push position off;", "ok;"),
        # Arguments that make no sense.
        ("chassis speed;", "command format error: command parse error;"),
        ("chassis speed x;", "command format error: command parse error;"),
        ("chassis speed q 1 seq 3;", "command format error: command parse error seq 3;"),
        ("chassis speed x 1 x 2;", "command format error: command parse error;"),
        ("chassis  speed x 1;", "command format error: command parse error;"),
        ("chassis speed x one;", "command format error: command parse error;"),
        ("chassis push position on pfreq 7;", "command format error: command parse error;"),
        ("chassis push freq 5;", "command format error: command parse error;"),
        ("chassis push position maybe;", "command format error: command parse error;"),
        ("robot mode fly;", "command format error: command parse error;"),
        ("robot battery !;", "command format error: command parse error;"),
        ("version 2;", "command format error: command parse error;"),
        (";", "command format error: command parse error;"),
        ("\n;", "fail;"),
        ("version seq;", "command format error: no seq value;"),
        ("version seq five;", "command format error: seq parse error;"),
        ("version seq 5 6;", "command format error: seq parse error;"),
        # What this robot cannot do.
        ("chassis speed x 3.6;", "fail;"),
        ("chassis speed z 601 seq 1;", "fail seq 1;"),
        ("chassis speed x nan;", "fail;"),
        ("chassis speed x 1e999;", "fail;"),
        ("chassis wheel w1 1001;", "fail;"),
        ("gimbal speed p 1 y 1;", "fail;"),
        ("chassis move x 1;", "ok;"),
        ("chassis move x 0.1 y 0 z 90 vxy 0.5 vz 90 seq 3;", "ok seq 3;"),
        ("chassis move x 6;", "fail;"),
        ("chassis move x 1 vxy 0;", "fail;"),
        ("chassis move z nan;", "fail;"),
        ("chassis move far 1;", "command format error: command parse error;"),
        ("chassis;", "fail;"),
    ],
)
def test_the_answer_to(robot, text, answer):
    assert robot.say(text) == answer


def test_a_refused_command_moves_nothing_and_is_a_fault(robot):
    robot.say("chassis speed x 3.6;chassis speed x nan;chassis speed x 1 q 1;chassis wheel w1 nan;")
    assert robot.plant.velocity_body == STOP
    assert robot.node.faults == robot.node.refused == 4


def test_y_is_to_the_right_and_z_clockwise_in_degrees(robot):
    robot.say("chassis speed x 0.5 y 0.25 z 90;")
    assert robot.plant.velocity_body == pytest.approx((0.5, -0.25, -math.pi / 2))
    assert robot.say("chassis speed ?;").split(" ")[:3] == ["0.500", "0.250", "90.000"]


def test_a_move_goes_its_way_and_then_stands(robot):
    robot.say("chassis move x 0.3 y 0.4 vxy 0.5;")
    robot.run(0.5)
    assert robot.plant.velocity_body == pytest.approx((0.3, -0.4, 0.0))
    robot.run(1.0)
    assert robot.plant.velocity_body == STOP
    assert robot.plant.position_xy_m == pytest.approx((0.3, -0.4), abs=0.01)


def test_a_move_that_turns_keeps_to_its_line(robot):
    robot.say("chassis move x 0.5 z 90 vxy 0.5 vz 90;")
    robot.run(1.5)
    assert robot.plant.position_xy_m == pytest.approx((0.5, 0.0), abs=0.02)
    assert robot.plant.heading_rad == pytest.approx(-math.pi / 2, abs=0.03)
    assert robot.plant.velocity_body == STOP


@pytest.mark.parametrize("text", ["chassis speed x 0.1;", "chassis wheel w1 19 w2 19 w3 19 w4 19;", "quit;command;"])
def test_whatever_comes_after_a_move_ends_it(robot, text):
    robot.say("chassis move x 2;")
    robot.say(text)
    robot.run(1.0)
    assert robot.plant.velocity_body.vx_mps == pytest.approx(0.0 if text.startswith("quit") else 0.1, abs=0.001)


def test_a_number_may_be_hexadecimal(robot):
    robot.say("chassis speed x 0x2 z 0x10;")
    assert robot.plant.velocity_body == pytest.approx((2.0, 0.0, math.radians(-16)))


@pytest.mark.parametrize(
    ("turns", "velocity"),
    [
        ("w1 95.493 w2 95.493 w3 95.493 w4 95.493", (0.5, 0.0, 0.0)),
        ("w1 -95.493 w2 95.493 w3 -95.493 w4 95.493", (0.0, -0.5, 0.0)),
        ("w1 -60 w2 60 w3 60 w4 -60", (0.0, 0.0, -math.pi / 2)),
    ],
)
def test_wheels_turn_forwards_and_run_round_from_the_front_right(robot, turns, velocity):
    robot.say(f"chassis wheel {turns};")
    assert robot.plant.velocity_body == pytest.approx(velocity, abs=1e-4)


def test_wheel_speeds_are_told_right_before_left(robot):
    robot.say("chassis speed z 90;")
    assert robot.say("chassis speed ?;").split(" ")[3:7] == ["-60", "60", "-60", "60"]


def test_while_the_gimbal_leads_the_chassis_does_not_turn(robot):
    robot.say("robot mode gimbal_lead;chassis speed x 0.5 z 90;")
    assert robot.plant.velocity_body == BodyVelocity(0.5, 0.0, 0.0)
    robot.say("quit;command;")
    assert robot.say("robot mode ?;") == "chassis_lead ;"


def test_the_robot_has_no_deadman(robot):
    robot.say("chassis speed x 0.5;")
    robot.run(20.0)
    assert robot.plant.velocity_body == BodyVelocity(0.5, 0.0, 0.0)


def test_a_client_that_goes_stops_the_robot(robot):
    robot.say("chassis push position on;chassis speed x 0.5;")
    robot.say("chassis speed x 3.")
    robot.wires[0].arriving.append(None)
    robot.run(0.01)
    assert robot.plant.velocity_body == STOP
    assert not robot.node.is_taken
    robot.run(1.0)
    assert len(robot.wires[0].pushed) == 0
    assert robot.say("command;") == "ok;"


def test_the_first_line_that_says_command_has_the_robot():
    robot = Robot(ports=2)
    assert robot.say("command;", 1) == "ok;"
    assert robot.say("command;version;chassis speed x 1;quit;", 0) == ""
    robot.wires[0].arriving.append(None)
    robot.run(0.01)
    assert robot.node.is_taken
    assert robot.plant.velocity_body == STOP
    robot.say("quit;", 1)
    assert robot.say("command;", 0) == "ok;"
    assert robot.say("version;", 1) == ""


def test_a_push_names_its_topic_once_and_joins_what_is_due(robot):
    robot.say("chassis push position on pfreq 50 attitude on afreq 10 status on sfreq 1;")
    robot.say("chassis speed x 0.5 y 0.25 z 90;")
    robot.run(1.0)
    pushed = [text.decode() for text in robot.wires[0].pushed]
    assert len(pushed) == 50
    assert sum("attitude" in text for text in pushed) == 10
    assert sum("status" in text for text in pushed) == 1
    robot.run(1.0)
    # Asked for at 0.02 s, so all three are due at 2.02 s; turning began at 0.03 s.
    joined = [text.decode() for text in robot.wires[0].pushed if b"status" in text][-1]
    assert re.fullmatch(
        r"chassis push position (\S+) (\S+) (\S+) ; attitude 0.000 0.000 \3 ; status 0 0 0 0 0 0 0 0 0 0 0 ;;", joined
    )
    assert float(joined.split(" ")[5]) == pytest.approx(1.99 * 90.0)


def test_older_firmware_pushes_a_position_of_two_numbers():
    robot = Robot(pushes_heading=False)
    robot.say("command;chassis push position on freq 50;")
    robot.run(0.05)
    assert robot.wires[0].pushed[0] == b"chassis push position 0.000 0.000 ;;"
    assert robot.say("chassis position ?;") == "0.000 0.000 0.000 ;"


def test_a_push_comes_five_times_a_second_unless_asked(robot):
    robot.say("chassis push position on;")
    robot.run(2.0)
    assert len(robot.wires[0].pushed) == 10
    robot.wires[0].pushed.clear()
    robot.say("chassis push position on pfreq 50 freq 1;")
    robot.run(2.0)
    assert len(robot.wires[0].pushed) == 2
    robot.say("chassis push position off;")
    robot.wires[0].pushed.clear()
    robot.run(2.0)
    assert robot.wires[0].pushed == []


def test_a_pose_is_told_from_where_the_robot_was_switched_on():
    robot = Robot()
    robot.plant.command(0.0, BodyVelocity(0.0, 0.0, math.pi / 2))
    robot.plant.step(1.0)
    robot.plant.command(1.0, STOP)
    robot.node = PlaintextMotionController(robot.controller, robot.wires)
    robot.now_s = 1.0
    robot.say("command;")
    robot.say("chassis speed x 1;")
    robot.run(1.0)
    assert robot.plant.position_xy_m == pytest.approx((0.0, 1.0))
    assert robot.say("chassis position ?;") == "1.000 0.000 0.000 ;"
    assert robot.say("chassis attitude ?;") == "0.000 0.000 0.000 ;"


def test_more_commands_than_the_robot_queues_are_lost(robot):
    answers = robot.say("version;" * (MOST_QUEUED + 88))
    assert answers.count(";") == MOST_QUEUED
    assert robot.node.dropped == robot.node.faults == 88


def test_a_text_without_end_is_a_fault_and_what_follows_is_heard(robot):
    for _ in range(50):
        assert robot.say("x" * 1000) == ""
    assert robot.say(";version;") == "version 00.00.00.00;"
    assert robot.node.faults == 1


def test_shutting_down_releases_every_line(robot):
    robot.node.shutdown()
    assert robot.wires[0].is_shut_down


speeds = st.tuples(st.floats(-3.5, 3.5), st.floats(-3.5, 3.5), st.floats(-600.0, 600.0))


@given(st.lists(speeds, min_size=1, max_size=8), st.lists(st.integers(0, 600), max_size=30))
def test_commands_in_any_portions_are_obeyed_once_in_order(wanted, cuts):
    robot = Robot()
    robot.say("command;")
    taken = []
    robot.controller.command_speed = lambda now_s, *speed: taken.append(speed)
    stream = "".join(f"chassis speed x {x:.4f} y {y:.4f} z {z:.3f};" for x, y, z in wanted)
    last = 0
    for cut in [*sorted(cuts), len(stream)]:
        robot.say(stream[last:cut])
        last = max(last, cut)
    expected = [(round(x, 4), -round(y, 4), -math.radians(round(z, 3))) for x, y, z in wanted]
    assert [part for speed in taken for part in speed] == pytest.approx([part for speed in expected for part in speed])
    assert robot.wires[0].said == b"ok;" * (1 + len(wanted))


@given(st.lists(st.binary(max_size=100).filter(lambda data: b"command" not in data), max_size=20))
def test_without_the_word_command_nothing_moves_a_robot(chunks):
    robot = Robot()
    for chunk in chunks:
        assert robot.say(chunk) == ""
    assert all(velocity == STOP for _, velocity in robot.plant.commands)
    assert not robot.node.is_taken


phrases = st.sampled_from(
    [
        "command;", "quit;", "chassis speed ", "chassis wheel ", "x 0.5 ", "y -1", "z 0x10", "w1 20", "w3 1e9",
        " seq 4", "chassis push position on", "nan", "inf", "99999999999", "?", " ", ";", ";", "\0", "\n", "é",
    ]
)  # fmt: skip


def check_demands(robot):
    for _, velocity in robot.plant.commands:
        assert velocity.is_finite()
        assert math.hypot(velocity.vx_mps, velocity.vy_mps) <= 7.5
        assert abs(velocity.wz_radps) <= 27.0


@given(st.lists(st.lists(phrases, max_size=40), max_size=20))
def test_mangled_commands_never_drive_beyond_the_limits(chunks):
    robot = Robot(ports=2)
    robot.say("command;")
    for number, chunk in enumerate(chunks):
        robot.say("".join(chunk).encode(), number % 2)
    check_demands(robot)
    text = "".join(part for chunk in chunks for part in chunk)
    moves = sum(velocity != STOP for _, velocity in robot.plant.commands)
    assert moves <= text.count("speed") + text.count("wheel")
    assert robot.node.obeyed + robot.node.refused <= 1 + text.count(";")


@given(st.lists(speeds, min_size=1, max_size=5), st.lists(st.tuples(st.integers(0, 400), st.binary(max_size=2))))
def test_spoilt_traffic_keeps_no_robot_from_its_next_command(wanted, spoils):
    stream = bytearray("".join(f"chassis speed x {x:.4f} y {y:.4f} z {z:.3f} seq 7;" for x, y, z in wanted), "ascii")
    for place, data in spoils:
        stream[place : place + 1] = data.replace(b"q", b"")  # whoever says quit must say command again
    robot = Robot()
    robot.say("command;")
    robot.say(bytes(stream))
    check_demands(robot)
    assert robot.say("; chassis speed x 0.25;chassis speed x 0.25;").endswith("ok;")
    assert robot.plant.velocity_body == BodyVelocity(0.25, 0.0, 0.0)


@given(st.binary(max_size=400))
def test_any_bytes_in_sdk_mode_are_answered_in_ascii_or_not(data):
    robot = Robot()
    robot.say("command;")
    answer = robot.say(data)
    assert answer.isascii()
    assert answer.count(";") <= data.count(b";")
