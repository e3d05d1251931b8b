import os
import socket
import stat
import subprocess
import sys

import pytest

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import MtmError
from mtm_onboard.runtime.client import BaseCommandClient
from mtm_onboard.runtime.datagram_source import SILENT_S, UdpSource, UnixSource
from mtm_onboard.runtime.source import Command

FIRST, SECOND = BodyVelocity(0.3, 0.0, -0.5), BodyVelocity(-0.1, 0.2, 0.0)
# Another process that sends what it is told to, line by line, and says when it has.
OTHER = """
import socket, sys
where = sys.argv[1]
sender = socket.socket(socket.AF_UNIX if "/" in where else socket.AF_INET, socket.SOCK_DGRAM)
address = where if "/" in where else ("127.0.0.1", int(where))
for line in sys.stdin:
    sender.sendto(line.encode(), address)
    print(flush=True)
"""


class Ends:
    """A source, a client of it, and another process that sends to it as well."""

    def __init__(self, source, address) -> None:
        self.source = source
        self.address = address
        self.client = BaseCommandClient(address)
        self._other: subprocess.Popen[str] | None = None
        source.poll(0.0)

    def send(self, data: bytes) -> None:
        """From this process, and from one port."""
        vars(self.client)["_socket"].sendto(data, vars(self.client)["_address"])

    def send_from_another(self, text: str) -> None:
        if self._other is None:
            command = [sys.executable, "-c", OTHER, str(self.address)]
            self._other = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        print(text, file=self._other.stdin, flush=True)
        self._other.stdout.readline()

    def close(self) -> None:
        self.client.close()
        self.source.close()
        if self._other is not None:
            self._other.communicate(timeout=20)


@pytest.fixture(params=["unix", "udp"])
def ends(request, tmp_path):
    if request.param == "unix":
        ends = Ends(UnixSource(tmp_path / "r.base"), tmp_path / "r.base")
    else:
        source = UdpSource(0)
        ends = Ends(source, source.port)
    yield ends
    ends.close()


def test_a_client_sends_no_velocity_that_is_not_finite(ends):
    with pytest.raises(MtmError, match="finite"):
        ends.client.send(BodyVelocity(float("nan"), 0.0, 0.0))


def test_of_the_datagrams_that_came_the_newest_counts(ends):
    assert ends.client.send(FIRST)
    assert ends.client.send(SECOND)
    assert ends.source.poll(0.02) == Command(SECOND, 0.02, False)
    assert ends.source.poll(0.04) == Command(SECOND, 0.02, False)


def test_a_stop_among_other_datagrams_is_not_overtaken(ends):
    ends.client.stop()
    ends.client.send(FIRST)
    assert ends.source.poll(0.02) == Command(FIRST, 0.02, True)


def test_bad_datagrams_are_counted_and_leave_the_last_good_one(ends):
    ends.client.send(FIRST)
    for data in (b"nonsense", b"v nan 0 0", b"v 1 0 0" + b" " * 500, b""):
        ends.send(data)
    assert ends.source.poll(0.02) == Command(FIRST, 0.02, False)
    assert ends.source.refused == 4


def test_what_came_while_nobody_looked_is_as_old_as_the_pause(ends):
    ends.source.poll(0.02)
    ends.client.send(FIRST)
    assert ends.source.poll(1.5) == Command(FIRST, 0.02, False)


def test_the_first_sender_keeps_the_robot_and_others_are_counted(ends):
    for tick in range(1, 11):
        ends.client.send(FIRST)
        ends.send_from_another("v 9 9 9")
        assert ends.source.poll(0.02 * tick).velocity == FIRST
    assert ends.source.intrusions == 10
    assert ends.source.intruder not in ("", ends.source.sender)


def test_once_the_first_sender_is_silent_another_may_drive(ends):
    ends.client.send(FIRST)
    first = ends.source.poll(0.02)
    for tick in range(2, 60):
        ends.send_from_another("v -0.1 0.2 0")
        now_s = 0.02 * tick
        command = ends.source.poll(now_s)
        assert command.velocity == (FIRST if now_s - 0.02 <= SILENT_S else SECOND), now_s
    ends.client.send(FIRST)
    assert ends.source.poll(1.2).velocity == SECOND
    assert first.arrived_s == 0.02


def test_anybody_may_say_stop(ends):
    ends.client.send(FIRST)
    ends.source.poll(0.02)
    ends.send_from_another("stop")
    assert ends.source.poll(0.04) == Command(FIRST, 0.02, True)
    assert ends.source.intrusions == 0


def test_a_stop_behind_many_datagrams_comes_in_the_same_tick():
    source = UdpSource(0)
    client = BaseCommandClient(source.port)
    for _ in range(2000):
        client.send(FIRST)
    client.stop()
    # Either it was in the buffer, or it was among what the system dropped.
    assert source.poll(0.02).stop
    client.close()
    source.close()


def test_in_a_flood_the_driver_s_command_and_each_stop_count():
    source = UdpSource(0)
    driver, other = BaseCommandClient(source.port), BaseCommandClient(source.port)
    driver.send(FIRST)
    source.poll(0.02)
    driver.send(SECOND)
    for _ in range(200):
        other.send(FIRST)
    assert source.poll(0.04) == Command(SECOND, 0.04, False)
    assert source.intrusions == 200
    other.stop()
    for _ in range(200):
        other.send(FIRST)
    assert source.poll(0.06) == Command(SECOND, 0.04, True)
    assert source.intrusions == 400
    driver.close()
    other.close()
    source.close()


def test_what_the_system_drops_counts_as_a_stop_and_is_told():
    source = UdpSource(0)
    client = BaseCommandClient(source.port)
    client.send(FIRST)
    assert not source.poll(0.02).stop
    assert source.lost == 0
    for _ in range(30_000):
        client.send(FIRST)
    assert source.poll(0.04).stop
    assert source.lost > 10_000
    client.close()
    source.close()


def test_a_full_socket_refuses_a_velocity_and_makes_a_stop_wait(tmp_path, monkeypatch):
    source = UnixSource(tmp_path / "r.base")
    client = BaseCommandClient(tmp_path / "r.base")
    while client.send(FIRST):
        pass
    monkeypatch.setattr("mtm_onboard.runtime.client._PATIENCE_S", 0.05)
    with pytest.raises(MtmError, match="by hand"):
        client.stop()
    assert not source.poll(0.02).stop
    client.stop()
    assert source.poll(0.04).stop
    client.close()
    source.close()


def test_a_client_outlives_its_run_and_says_when_none_hears(tmp_path):
    source = UnixSource(tmp_path / "r.base")
    client = BaseCommandClient(str(tmp_path / "r.base"))
    assert client.send(FIRST)
    source.close()
    assert not client.send(FIRST)
    with pytest.raises(MtmError, match="stop the robot by hand"):
        client.stop()
    again = UnixSource(tmp_path / "r.base")
    assert client.send(FIRST)
    assert again.poll(0.0).velocity == FIRST
    again.close()
    client.close()


def test_the_socket_is_for_owner_and_group_whatever_the_umask(tmp_path):
    former = os.umask(0o077)
    try:
        source = UnixSource(tmp_path / "r.base")
    finally:
        os.umask(former)
    assert stat.S_IMODE((tmp_path / "r.base").stat().st_mode) == 0o660
    source.close()
    assert not (tmp_path / "r.base").exists()


def test_a_place_in_use_is_refused_and_a_crash_s_is_taken(ends, tmp_path):
    with pytest.raises(MtmError, match="choose another port|another run listens"):
        type(ends.source)(ends.address)
    left = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    left.bind(str(tmp_path / "left.base"))
    left.close()
    UnixSource(tmp_path / "left.base").close()
