import os
import socket
import time

import pytest

from hil.vehicles.motion_controller import MotionController
from hil.vehicles.plaintext_node import PlaintextMotionController
from hil.wires.plaintext_ports import LinePort, PtyPort, TcpPort
from mtm_onboard.links.robomaster_tcp import RoboMasterTcp
from mtm_onboard.links.robomaster_uart import RoboMasterUart
from mtm_onboard.model.velocity import STOP, BodyVelocity
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.links.plaintext_rig import free_udp_port
from tests.patience import PATIENCE_S


def until(condition, act=lambda: None):
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline_s
        act()


def received(port, count):
    data = b""

    def take():
        nonlocal data
        data += port.receive() or b""

    until(lambda: len(data) >= count, take)
    return data


@pytest.fixture
def tcp():
    port = TcpPort(push_port=free_udp_port())
    yield port
    port.shutdown()


def client_of(port):
    return socket.create_connection(("127.0.0.1", port.port), PATIENCE_S)


def test_a_line_without_room_loses_whole_texts_and_never_waits():
    ours, theirs = socket.socketpair()
    with ours, theirs:
        port = LinePort(ours.fileno(), lambda: None)
        theirs.setblocking(False)
        for number in range(100_000):
            port.answer(b"ok seq %d;" % number)
            if port.lost_texts == 10:
                break
        texts = []
        for _ in range(100):
            try:
                texts.append(theirs.recv(1_000_000))
            except BlockingIOError:
                port.receive()
        numbers = [int(text.removeprefix(b"ok seq ")) for text in b"".join(texts).split(b";")[:-1]]
        assert numbers == list(range(len(numbers)))
        assert len(numbers) == number + 1 - 10


def test_a_line_whose_client_has_gone_says_so():
    ours, theirs = socket.socketpair()
    with ours:
        port = LinePort(ours.fileno(), lambda: None)
        theirs.close()
        assert port.receive() is None
        port.answer(b"ok;")
        port.shutdown()
        port.shutdown()
        assert port.receive() is None


def test_a_pseudo_terminal_outlives_its_clients():
    port = PtyPort()
    try:
        for text in (b"command;", b"quit;"):
            line = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
            os.write(line, text)
            assert received(port, len(text)) == text
            os.close(line)
            assert port.receive() == b""
    finally:
        port.shutdown()


def test_clients_come_in_turn_and_each_farewell_is_told_once(tcp):
    assert tcp.receive() == b""
    with client_of(tcp) as first, client_of(tcp) as second:
        first.sendall(b"one;")
        second.sendall(b"two;")
        assert received(tcp, 4) == b"one;"
        assert tcp.receive() == b""
        tcp.answer(b"ok;")
        assert first.recv(10) == b"ok;"
        first.close()
        farewells = []
        until(lambda: None in farewells, lambda: farewells.append(tcp.receive()))
        assert received(tcp, 4) == b"two;"


def test_telemetry_goes_to_the_client_s_host_by_datagram(tcp):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener, client_of(tcp) as client:
        listener.bind(("127.0.0.1", tcp._push_port))
        listener.settimeout(PATIENCE_S)
        client.sendall(b"x")
        received(tcp, 1)
        tcp.push(b"chassis push position 0.000 0.000 ;;")
        assert listener.recv(100) == b"chassis push position 0.000 0.000 ;;"


def test_without_a_client_nothing_is_said(tcp):
    tcp.answer(b"ok;")
    tcp.push(b"chassis push position 0.000 0.000 ;;")
    assert tcp.receive() == b""


class Driven:
    """A robot at `port`, polled each 10 ms of its own time, and a transport that has it drive forwards."""

    def __init__(self, port, transport):
        self.plant = FloatingPlant()
        self.node = PlaintextMotionController(MotionController(self.plant, deadman_s=None), [port])
        self.transport = transport
        self.polls = 0
        transport.open()
        transport.send(BodyVelocity(0.25, 0.5, 0.0))
        until(lambda: self.plant.velocity_body == BodyVelocity(0.25, 0.5, 0.0), self.poll)

    def poll(self):
        self.polls += 1
        self.node.poll(0.01 * self.polls)
        self.transport.service(0.01 * self.polls)


def test_a_robot_on_a_serial_line_drives_on_without_its_client():
    port = PtyPort()
    robot = Driven(port, RoboMasterUart(port.path))
    until(lambda: (told := robot.transport.telemetry) is not None and told.position_xy_m[1] > 0.1, robot.poll)
    robot.transport.close()
    for _ in range(1000):
        robot.poll()
    assert robot.plant.velocity_body == BodyVelocity(0.25, 0.5, 0.0)
    assert robot.node.is_taken
    # The next client finds it in SDK mode and stops it.
    with RoboMasterUart(port.path) as transport:
        robot.transport = transport
        until(lambda: robot.plant.velocity_body == STOP, robot.poll)
        until(lambda: transport.unanswered == 0, robot.poll)
    assert robot.node.faults == transport.refusals == transport.malformed == 0
    robot.node.shutdown()


def test_a_robot_on_the_network_stops_without_its_client(tcp):
    robot = Driven(tcp, RoboMasterTcp("127.0.0.1", tcp.port, tcp._push_port))
    until(lambda: (told := robot.transport.telemetry) is not None and told.position_xy_m[1] > 0.1, robot.poll)
    robot.transport.close()
    until(lambda: not robot.node.is_taken, robot.poll)
    assert robot.plant.velocity_body == STOP
    assert robot.node.faults == robot.transport.refusals == robot.transport.malformed == 0


def test_clients_of_the_event_port_are_let_in_and_told_nothing():
    port = TcpPort(push_port=free_udp_port(), event_port=0)
    try:
        clients = [socket.create_connection(("127.0.0.1", port.event_port), PATIENCE_S) for _ in range(10)]
        for _ in range(20):
            port.receive()
        clients[-1].setblocking(False)
        with pytest.raises(BlockingIOError):
            clients[-1].recv(1)
        # The oldest give way, so that whoever keeps connecting takes no more and more descriptors.
        assert clients[0].recv(1) == b""
        for client in clients:
            client.close()
    finally:
        port.shutdown()
