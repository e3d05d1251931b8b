import os
import pty
import socket

import pytest

from hil.fleet.clock import SimulatedClock
from hil.plants.unicycle import UnicyclePlant
from hil.vehicles.mavlink_firmware import ROVER
from hil.vehicles.mavlink_vehicle import MavlinkVehicle
from mtm_onboard.links.mavlink import MavlinkLink
from mtm_onboard.links.mavlink_codec import MavlinkCodec
from mtm_onboard.links.mavlink_ports import StreamPort, UdpPort, port_opener
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError

BOUND_S = 0.0025


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.mark.parametrize(
    "endpoint",
    ["", "udpin:14550", "udp:127.0.0.1:14550", "udpout:127.0.0.1:0", "tcp:127.0.0.1:65536", "tcp::5760",
     "udpin:127.0.0.1:-1", "udpout:127.0.0.1:port"],
)  # fmt: skip
def test_a_wrong_endpoint_is_refused_before_anything_is_opened(endpoint):
    with pytest.raises(MtmError, match="give udpin:HOST:PORT"):
        port_opener(endpoint, 57_600, BOUND_S)


@pytest.mark.parametrize(
    ("endpoint", "sentence"),
    [
        ("/dev/there-is-no-such-line", "cannot be opened"),
        ("udpin:192.0.2.1:14550", "cannot be used"),
        ("udpout:no.such.host.invalid:14550", "cannot be used"),
        (f"tcp:127.0.0.1:{free_port()}", "cannot be reached"),
    ],
)
def test_an_endpoint_that_cannot_be_had_is_one_sentence(endpoint, sentence):
    with pytest.raises(MtmError, match=sentence):
        port_opener(endpoint, 57_600, BOUND_S)()


def test_a_serial_line_carries_frames_both_ways():
    master, slave = pty.openpty()
    port = port_opener(os.ttyname(slave), 57_600, BOUND_S)()
    try:
        port.write(b"\xfd\x00\x11\x13\n\r\x03")
        assert os.read(master, 100) == b"\xfd\x00\x11\x13\n\r\x03"
        os.write(master, b"\xfd\x00\x11\x13\x04")
        assert b"".join(port.read() for _ in range(3)) == b"\xfd\x00\x11\x13\x04"
    finally:
        port.close()
        os.close(master)
        os.close(slave)


def test_a_tcp_connection_carries_frames_until_the_end_is_gone():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = port_opener(f"tcp:127.0.0.1:{server.getsockname()[1]}", 0, BOUND_S)()
        accepted, _ = server.accept()
        with accepted:
            assert isinstance(port, StreamPort)
            port.keep_sender()
            port.write(b"frame")
            assert accepted.recv(100) == b"frame"
            assert port.read() == b""
        with pytest.raises(MtmError, match="closed the link"):
            port.read()
        port.close()


def test_a_listening_port_settles_on_one_sender():
    listening = UdpPort(listen=("127.0.0.1", 0))
    vehicle, stranger = (UdpPort(peer=("127.0.0.1", listening.number)) for _ in range(2))
    try:
        listening.write(b"lost")
        stranger.write(b"spam")
        vehicle.write(b"heartbeat")
        assert [listening.read() for _ in range(2)] == [b"spam", b"heartbeat"]
        listening.keep_sender()
        stranger.write(b"more spam")
        vehicle.write(b"position")
        assert [listening.read() for _ in range(2)] == [b"position", b""]
        listening.write(b"command")
        assert (vehicle.read(), stranger.read()) == (b"command", b"")
        listening.keep_sender()
    finally:
        for port in (listening, vehicle, stranger):
            port.close()


def test_a_closed_udp_port_says_so():
    port = UdpPort(peer=("127.0.0.1", 9))
    port.close()
    with pytest.raises(MtmError, match="refused a message"):
        port.write(b"frame")
    with pytest.raises(MtmError, match="cannot be read"):
        port.read()


@pytest.mark.parametrize("listens", ["transport", "vehicle"])
def test_a_rover_is_driven_over_udp_and_a_stranger_gets_nothing(listens):
    clock, number = SimulatedClock(), free_port()
    here = ("127.0.0.1", number)
    there = UdpPort(peer=here) if listens == "transport" else UdpPort(listen=here)
    plant = UnicyclePlant(lag_s=0.1)
    vehicle = MavlinkVehicle(ROVER, plant, there, is_guided=True, is_armed=True)
    kind = "udpin" if listens == "transport" else "udpout"
    transport = MavlinkLink(f"{kind}:127.0.0.1:{number}", profile="rover", clock=clock)
    stranger = UdpPort(peer=here)
    other = MavlinkCodec(66, 1)
    clock.every(0.010, vehicle.poll)
    clock.every(0.010, transport.service)
    # A stranger that is no vehicle speaks first and goes on speaking.
    clock.every(0.1, lambda _: stranger.write(other.encode(other.messages.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))))
    try:
        with transport:
            for _ in range(100):
                transport.send(BodyVelocity(-0.5, 0.0, 0.4))
                clock.sleep_until(clock.now() + 0.02)
            assert plant.velocity_body == pytest.approx((-0.5, 0.0, 0.4), abs=1e-6)
        clock.sleep_until(clock.now() + 2.0)
        assert plant.velocity_body == pytest.approx(STOP, abs=1e-6)
        # It drove backwards on a circle of radius 0.5 / 0.4, lagging 0.1 s behind.
        assert plant.heading_rad == pytest.approx(0.4 * 2.0, abs=0.03)
        assert plant.position_xy_m[0] == pytest.approx(-1.25 * 0.717, abs=0.03)
        assert plant.position_xy_m[1] < -0.3
        assert stranger.read() == b""
    finally:
        there.close()
        stranger.close()
