import os
import select
import time

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.fleet.clock import AnsweringClock, SimulatedClock
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.motion_controller import MotionController
from hil.wires.slcan_port import SlcanPort
from mtm_onboard.links.robomaster_can import RoboMasterCan
from mtm_onboard.model.velocity import STOP, BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.patience import PATIENCE_S


@pytest.fixture
def port():
    port = SlcanPort()
    yield port
    port.shutdown()


@pytest.fixture
def line(port):
    """The far end of the port, as a program sees it."""
    descriptor = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
    os.set_blocking(descriptor, False)
    yield descriptor
    os.close(descriptor)


def received(port):
    frame = port.recv(0)
    return [] if frame is None else [frame, *received(port)]


def replies(port, line, text, ends):
    """Write `text` and return the frames that came in and the reply, read until it has `ends` line ends."""
    os.write(line, text)
    frames, reply, deadline_s = [], b"", time.monotonic() + PATIENCE_S
    while reply.count(b"\r") + reply.count(b"\a") < ends and time.monotonic() < deadline_s:
        frames += received(port)
        if select.select([line], [], [], 0.001)[0]:
            reply += os.read(line, 4096)
    return frames, reply


def test_a_session_of_the_published_protocol(port, line):
    assert replies(port, line, b"C\rS8\rO\r", 3) == ([], b"\a\r\r")
    assert port.is_open
    frames, reply = replies(port, line, b"t20130102AA\rT1ABCDEF00\r", 2)
    assert reply == b"z\rZ\r"
    assert [(frame.arbitration_id, frame.is_extended_id, bytes(frame.data)) for frame in frames] == [
        (0x201, False, b"\x01\x02\xaa"),
        (0x1ABCDEF0, True, b""),
    ]
    assert replies(port, line, b"V\rN\rF\r\rC\r", 5) == ([], b"V1013\rN0001\rF00\r\r\r")
    assert not port.is_open


@pytest.mark.parametrize(
    "bad", [b"t2013010\r", b"t201901\r", b"t801100\r", b"t2011xx\r", b"q\r", b"S8\r", b"O\r", b"t" * 500 + b"\r"]
)
def test_a_line_that_makes_no_sense_gets_a_bell(port, line, bad):
    replies(port, line, b"O\r", 1)
    frames, reply = replies(port, line, bad + b"t201155\r", 2)
    assert reply == b"\az\r"
    assert [bytes(frame.data) for frame in frames] == [b"\x55"]
    assert port.refused_lines == 1


@pytest.mark.parametrize("state", [b"C\r", b"L\r"])
def test_nothing_is_sent_through_a_closed_or_listening_channel(port, line, state):
    replies(port, line, state, 1)
    assert replies(port, line, b"t201155\r", 1) == ([], b"\a")


def test_a_line_that_comes_in_parts_is_put_together(port, line):
    replies(port, line, b"O\r", 1)
    os.write(line, b"t2011")
    assert received(port) == []
    frames, _ = replies(port, line, b"55\r", 1)
    assert [bytes(frame.data) for frame in frames] == [b"\x55"]


def test_frames_go_out_only_while_the_channel_is_open(port, line):
    frame = can.Message(arbitration_id=0x202, is_extended_id=False, data=b"\x01\xab")
    port.send(frame)
    assert replies(port, line, b"O\r", 1) == ([], b"\r")
    port.send(frame)
    port.send(can.Message(arbitration_id=0x1ABCDEF0, is_extended_id=True))
    assert replies(port, line, b"", 2) == ([], b"t202201AB\rT1ABCDEF00\r")


def test_a_reader_who_falls_behind_never_blocks_the_robot(port, line):
    replies(port, line, b"O\r", 1)
    frame = can.Message(arbitration_id=0x202, is_extended_id=False, data=bytes(8))
    for _ in range(5000):
        port.send(frame)
    assert 0 < port.lost_frames < 5000
    _, text = replies(port, line, b"", 5000 - port.lost_frames)
    assert text == b"t20280000000000000000\r" * (5000 - port.lost_frames)


@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), min_size=1, max_size=20))
def test_python_cans_adapter_exchanges_any_frames(frames):
    port = SlcanPort()
    bus = can.Bus(interface="slcan", channel=port.path, bitrate=1_000_000, sleep_after_open=0)
    try:
        got, deadline_s = [], time.monotonic() + PATIENCE_S
        for number, data in frames:
            bus.send(can.Message(arbitration_id=number, is_extended_id=False, data=data))
        while len(got) < len(frames) and time.monotonic() < deadline_s:
            got += received(port)
        assert [(frame.arbitration_id, bytes(frame.data)) for frame in got] == frames
        back = []
        for frame in got:
            port.send(frame)
        while len(back) < len(frames) and time.monotonic() < deadline_s:
            received(port)
            back += [frame for frame in [bus.recv(0.01)] if frame is not None]
        assert [(frame.arbitration_id, bytes(frame.data)) for frame in back] == frames
    finally:
        bus.shutdown()
        port.shutdown()


def test_a_robot_is_driven_and_reports_through_the_port(port):
    plant = FloatingPlant()
    node = CanMotionController(MotionController(plant, deadman_s=None), port)
    clock = AnsweringClock(SimulatedClock(), node.poll)
    transport = RoboMasterCan(interface="slcan", channel=port.path, sleep_after_open=0, clock=clock)
    deadline_s = time.monotonic() + PATIENCE_S
    beat = 0

    def run_until(condition):
        nonlocal beat
        while not condition():
            assert time.monotonic() < deadline_s
            beat += 1
            node.poll(0.01 * beat)
            transport.service(0.01 * beat)

    with transport:
        run_until(lambda: node.controller.work_mode)
        transport.send(BodyVelocity(0.25, 0.5, 0.0))
        run_until(lambda: transport.telemetry is not None and transport.telemetry.velocity_body_mps == (0.25, 0.5))
        assert plant.velocity_body == BodyVelocity(0.25, 0.5, 0.0)
        run_until(lambda: transport.heartbeats >= 20)
    run_until(lambda: not node.controller.work_mode)
    assert plant.velocity_body == STOP
    assert node.faults == 0
    assert transport.bus_errors == 0
