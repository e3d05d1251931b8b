import math
import socket
import threading
import time
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.wires.plaintext_ports import LinePort
from mtm_onboard.links.base import LinkBusyError
from mtm_onboard.links.factory import make_link
from mtm_onboard.links.robomaster_plaintext import MOST_UNANSWERED
from mtm_onboard.links.robomaster_tcp import RoboMasterTcp
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from tests.onboard.links.conformance import LinkConformance, Rig
from tests.onboard.links.plaintext_rig import OverSocket, free_udp_port, plaintext_rig
from tests.onboard.links.stalled_line import StalledLine
from tests.patience import PATIENCE_S

FORWARD = BodyVelocity(0.5, 0.0, 0.0)
OPENING = (
    b"command;command;chassis speed x 0.0000 y 0.0000 z 0.000 seq 1;robot mode free seq 2;"
    b"chassis push position on pfreq 10 attitude on afreq 10 seq 3;"
)
RELEASE = 3 * b"chassis speed x 0.0000 y 0.0000 z 0.000;" + 2 * b"quit;"


class TestRoboMasterPlaintextConforms(LinkConformance):
    @pytest.fixture(params=["memory", "pty", "tcp"])
    def rig(self, request):
        with plaintext_rig(request.param) as rig:
            yield Rig(
                rig.transport, rig.controller, rig.plant, rig.clock, rig.sent_bytes,
                refuse=rig.refuse, clog=rig.clog, cut=rig.cut, mend=rig.mend, remake=rig.remake,
            )  # fmt: skip


@pytest.fixture
def line():
    """A transport and the far end of its line, where nobody answers."""
    ours, theirs = socket.socketpair()
    theirs.settimeout(PATIENCE_S)
    with ours, theirs:
        yield OverSocket(ours), theirs


def arrived(end):
    return end.recv(1_000_000)


def fill(end):
    """Leave no room on a line that nobody reads."""
    end.setblocking(False)
    while True:
        try:
            end.send(b"x")
        except BlockingIOError:
            return


def test_opening_enters_sdk_mode_stands_still_and_subscribes(line):
    transport, far = line
    transport.open()
    assert arrived(far) == OPENING


def test_a_command_is_one_numbered_text(line):
    transport, far = line
    transport.open()
    arrived(far)
    transport.send(BodyVelocity(0.25, -0.5, math.radians(90)))
    assert arrived(far) == b"chassis speed x 0.2500 y 0.5000 z -90.000 seq 4;"


def test_stopping_says_zero_and_quit_more_than_once(line):
    transport, far = line
    transport.open()
    arrived(far)
    transport.stop()
    assert arrived(far) == RELEASE


@pytest.mark.parametrize("place", range(0, len(RELEASE), 3))
def test_one_spoilt_character_never_keeps_a_robot_from_stopping(place):
    with plaintext_rig() as rig:
        rig.transport.open()
        rig.transport.send(FORWARD)
        rig.run(0.05)
        assert rig.plant.velocity_body == FORWARD
        spoilt = bytearray(RELEASE)
        spoilt[place] ^= 0x02
        rig.links[0].write(bytes(spoilt), 0.1)
        rig.run(0.05)
        assert rig.plant.velocity_body == STOP
        assert not rig.node.is_taken


def test_half_a_command_in_the_line_does_not_spoil_the_opening():
    with plaintext_rig() as rig:
        rig.ends[0].send(b"chassis speed x 3.")
        rig.port.received -= len(b"chassis speed x 3.")
        with rig.transport:
            rig.run(0.05)
            rig.transport.send(FORWARD)
            rig.run(0.05)
            assert rig.plant.velocity_body == FORWARD
            assert rig.node.refused == 0


def test_every_command_is_answered_and_nothing_is_refused():
    with plaintext_rig() as rig, rig.transport:
        for _ in range(200):
            rig.transport.send(FORWARD)
            rig.run(0.02)
        assert rig.transport.health() == {
            "answers": 2 + 3 + 200, "refusals": 0, "malformed": 0, "link_errors": 0, "unanswered": 0
        }  # fmt: skip


def test_numbers_start_anew_after_ten_thousand(line):
    transport, far = line
    transport.open()
    for number in range(4, 10_050):
        transport.send(FORWARD)
        if number % 40 == 0:
            texts = arrived(far).split(b";")[:-1]
            far.send(b"".join(b"ok" + text[text.find(b" seq") :] + b";" for text in texts if b"seq" in text))
            transport.service(0.0)
            assert transport.unanswered == 0
    assert transport.malformed == 0
    assert transport.answers == 10_040


def test_telemetry_comes_back_in_rep_103():
    with plaintext_rig() as rig, rig.transport:
        assert rig.transport.telemetry is None
        for _ in range(50):
            rig.transport.send(BodyVelocity(0.25, 0.5, 0.5))
            rig.run(0.02)
        told = rig.transport.telemetry
        assert rig.clock.now() - told.received_s <= 0.1
        assert told.heading_rad == pytest.approx(rig.plant.heading_rad, abs=0.06)
        assert told.position_xy_m == pytest.approx(rig.plant.position_xy_m, abs=0.07)
        assert told.position_xy_m[1] > 0.1


@pytest.mark.parametrize("answer", [b"fail seq 4;", b"error seq 4;", b"command format error: seq parse error seq 4;"])
def test_a_refused_command_is_counted_and_is_an_answer(line, answer):
    transport, far = line
    transport.open()
    transport.send(FORWARD)
    far.send(answer)
    transport.service(0.0)
    assert (transport.refusals, transport.unanswered, transport.malformed) == (1, 0, 0)


@pytest.mark.parametrize("answer", [b"ok seq 5;", b"ok seq 0;", b"ok seq 10004;", b"ok seq 999999999;"])
def test_an_answer_to_what_was_never_sent_is_no_answer(line, answer):
    transport, far = line
    transport.open()
    transport.send(FORWARD)
    far.send(answer)
    transport.service(0.0)
    assert (transport.answers, transport.unanswered, transport.malformed) == (0, 4, 1)


def test_an_answer_counts_once_however_often_it_is_said(line):
    transport, far = line
    transport.open()
    far.send(b"ok seq 3;ok seq 3;")
    transport.service(0.0)
    assert (transport.answers, transport.malformed) == (1, 1)


def test_answers_and_pushes_may_come_in_any_portions(line):
    transport, far = line
    transport.open()
    for (
        value
    ) in b"ok;Already in SDK mode;ok seq 1;chassis push position 0.100 0.200 ; attitude 0.0 0.0 45.0 ;;ok seq 2;":
        far.send(bytes((value,)))
        transport.service(7.0)
    assert (transport.answers, transport.malformed, transport.unanswered) == (4, 0, 1)
    assert transport.telemetry.position_xy_m == (0.1, -0.2)
    assert transport.telemetry.heading_rad == pytest.approx(-math.pi / 4)
    assert transport.telemetry.received_s == 7.0


def test_a_robot_that_never_answers_is_a_link_that_is_down(line):
    transport, _ = line
    transport.open()
    for _ in range(MOST_UNANSWERED - 3):
        transport.send(FORWARD)
    with pytest.raises(MtmError, match="has not answered the last 50 commands"):
        transport.send(FORWARD)


def test_a_robot_that_another_link_holds_is_a_link_that_is_down():
    ours, theirs = socket.socketpair()
    with ours, theirs, plaintext_rig(others=[LinePort(theirs.fileno(), lambda: None)]) as rig:
        ours.send(b"command;")
        rig.run(0.02)
        with rig.transport, pytest.raises(MtmError, match="no other program or link holds it"):
            rig.drive(FORWARD, 2.0)
        assert rig.plant.velocity_body == STOP


def test_a_robot_out_of_sdk_mode_is_a_link_that_is_down(line):
    transport, far = line
    transport.open()
    far.send(b"not in sdk mode seq 3;")
    transport.service(0.0)
    assert transport.refusals == 1
    with pytest.raises(MtmError, match="has left SDK mode"):
        transport.send(FORWARD)
    transport.open()
    transport.send(FORWARD)


def test_a_robot_that_closes_the_line_is_a_link_that_is_down(line):
    transport, far = line
    transport.open()
    arrived(far)
    far.close()
    transport.service(0.0)
    transport.service(0.01)
    assert transport.link_errors == 1
    with pytest.raises(MtmError, match="closed the link"):
        transport.send(FORWARD)


def test_a_blocked_line_delays_a_command_within_the_bound(line, monkeypatch):
    transport, _ = line
    transport.open()
    fill(transport._end)
    stalled = StalledLine().install(monkeypatch)
    with pytest.raises(LinkBusyError):
        transport.send(FORWARD)
    assert stalled.waited_s <= transport.write_bound_s
    assert transport.link_errors == 1


def test_a_stop_that_cannot_be_sent_still_releases_the_line(line):
    transport, far = line
    transport.open()
    fill(transport._end)
    with pytest.raises(MtmError, match="switch the robot off by hand"):
        transport.stop()
    transport.close()
    written = transport.health()
    transport.service(0.0)
    transport.stop()
    assert transport.health() == written
    far.setblocking(False)


def test_a_stop_waits_longer_for_a_line_than_a_command_does(line, monkeypatch):
    transport, far = line
    transport.open()
    fill(transport._end)
    stalled = StalledLine(4 * transport.write_bound_s, make_room=lambda: arrived(far)).install(monkeypatch)
    transport.stop()
    assert stalled.waited_s >= 4 * transport.write_bound_s
    assert arrived(far).endswith(RELEASE)


def test_an_opening_that_fails_half_way_releases_the_line(line):
    transport, _ = line
    fill(transport._end)
    with pytest.raises(MtmError, match="switch the robot off by hand"):
        transport.open()
    with pytest.raises(MtmError, match="not open"):
        transport.send(FORWARD)


def test_commands_and_services_from_two_threads_do_not_mix():
    with plaintext_rig() as rig, rig.transport:
        done = threading.Event()

        def serve():
            while not done.is_set():
                rig.transport.service(0.0)

        serving = threading.Thread(target=serve)
        serving.start()
        try:
            for beat in range(400):
                rig.transport.send(FORWARD)
                rig.node.poll(0.01 * beat)
                while rig.transport.unanswered > 30:
                    pass
        finally:
            done.set()
            serving.join()
        assert rig.node.faults == 0
        assert rig.transport.malformed == 0
        assert rig.node.obeyed == 5 + 400


@given(st.lists(st.binary(max_size=60), max_size=20))
def test_any_bytes_from_the_line_leave_the_link_working(chunks):
    ours, theirs = socket.socketpair()
    with ours, theirs:
        transport = OverSocket(ours)
        transport.open()
        for chunk in chunks:
            theirs.send(chunk)
            transport.service(0.0)
        assert transport.answers + transport.refusals == 0 or any(b"ok" in chunk or b"f" in chunk for chunk in chunks)
        transport.send(FORWARD)
        answers = transport.answers
        theirs.send(b";ok seq 4;")
        transport.service(0.0)
        assert transport.answers == answers + 1
        assert transport.unanswered == 0


words = st.sampled_from(
    [
        b"ok",
        b" seq ",
        b"1",
        b"3",
        b"4",
        b";",
        b" ",
        b"chassis push ",
        b"position",
        b" 0.1",
        b"attitude",
        b"fail",
        b"\xff",
    ]
)


@given(st.lists(words, max_size=60))
def test_mangled_answers_never_answer_more_than_was_sent(parts):
    ours, theirs = socket.socketpair()
    with ours, theirs:
        transport = OverSocket(ours)
        transport.open()
        data = b"".join(parts)
        theirs.send(data or b";")
        transport.service(0.0)
        assert 0 <= transport.unanswered <= 3
        numbered = transport.answers + transport.refusals - data.count(b"ok;") - data.count(b"fail;")
        assert numbered <= 3 + data.count(b"ok ") + data.count(b"fail ")


def test_over_tcp_telemetry_comes_by_udp_from_the_robot_alone():
    with plaintext_rig("tcp") as rig, rig.transport:
        rig.transport.send(FORWARD)
        deadline_s = time.monotonic() + PATIENCE_S
        while rig.transport.telemetry is None or rig.transport.telemetry.heading_rad is None:
            assert time.monotonic() < deadline_s
            rig.run(0.02)
        assert rig.transport.telemetry.position_xy_m[0] > 0.0
        assert rig.transport.malformed == 0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.bind(("127.0.0.2", 0))
            stranger.sendto(b"chassis push position 9.0 9.0 ;;", ("127.0.0.1", rig.transport._push_port))
        for _ in range(20):
            rig.transport.service(0.0)
        assert rig.transport.telemetry.position_xy_m[0] < 1.0


def test_a_taken_push_port_leaves_no_connection_behind():
    with plaintext_rig("tcp") as rig, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("", rig.transport._push_port))
        with pytest.raises(MtmError, match="choose another push_port"):
            rig.transport.open()
        assert rig.links == []


def test_a_robot_that_is_not_there_is_one_sentence():
    with pytest.raises(MtmError, match="cannot be reached"):
        make_link("robomaster-tcp", {"host": "127.0.0.1", "port": 1, "push_port": free_udp_port()}).open()
    with pytest.raises(MtmError, match="/dev/there-is-none cannot be opened"):
        make_link("robomaster-uart", {"port": "/dev/there-is-none"}).open()


@pytest.mark.parametrize("host", ["robot.local", "192.168.2", "", "::1"])
def test_a_host_that_is_no_ip_address_is_one_sentence(host):
    with pytest.raises(MtmError, match="give its IP address"):
        RoboMasterTcp(host)


@pytest.mark.parametrize(("kind", "options"), [("robomaster-uart", {}), ("robomaster-tcp", {"hots": "x"})])
def test_options_that_a_link_does_not_take_are_one_sentence(kind, options):
    with pytest.raises(MtmError, match=r"correct \[transport\]"):
        make_link(kind, options)


def test_what_was_sent_is_what_arrives_on_a_line_that_fills(line):
    transport, far = line
    transport.open()
    data, sent = b"", 0
    for number in range(4000):
        try:
            transport.send(BodyVelocity(0.0001 * (number % 1000), 0.0, 0.0))
            sent += 1
        except LinkBusyError:
            data += arrived(far)
        vars(transport)["_answered"] = vars(transport)["_sent"]  # as if the robot had answered
    transport.stop()
    far.setblocking(False)
    with suppress(BlockingIOError):
        while part := far.recv(1_000_000):
            data += part
    assert sent < 4000
    assert data.removeprefix(OPENING).removesuffix(RELEASE).count(b";") == sent


def test_a_robot_that_falls_behind_is_doubted_before_it_is_lost(line):
    transport, far = line
    transport.open()
    for _ in range(12):
        transport.send(FORWARD)
    transport.service(0.0)
    assert transport.degraded == "the robot does not answer its commands"
    far.send(b"ok seq 15;")
    transport.service(0.1)
    assert transport.degraded == ""
