import errno
import os
import pty
import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.doctor.link import check_link, check_serial
from mtm_onboard.links import factory


@pytest.fixture
def serial_line():
    """The path of a serial line, and its other end."""
    far, near = pty.openpty()
    yield os.ttyname(near), far
    os.close(far)
    os.close(near)


def status(kind: str, **options) -> str:
    return check_link(kind, options).status


def test_a_dry_run_needs_no_link():
    assert status("none") == "pass"


def test_what_the_transport_does_not_take_is_a_failure():
    for kind, options in (("tachyon", {}), ("none", {"bitrate": 1}), ("robomaster-can", {}), ("mavlink", {})):
        found = check_link(kind, options)
        assert found.status == "fail"
        assert "; " in found.text


def test_nothing_is_written_to_a_serial_line_that_opens(serial_line):
    path, far = serial_line
    os.set_blocking(far, False)
    for found in (
        check_link("robomaster-uart", {"port": path}),
        check_link("robomaster-can", {"interface": "slcan", "channel": f"{path}@115200", "bitrate": 1_000_000}),
        check_link("mavlink", {"endpoint": path, "profile": "copter"}),
    ):
        assert found.status == "pass"
        assert path in found.text
    with pytest.raises(BlockingIOError):
        os.read(far, 1)


def test_a_serial_line_that_another_program_has_is_a_failure(serial_line):
    import serial

    path, _ = serial_line
    with serial.Serial(path, exclusive=True):
        assert "end" in check_serial(path).text
        assert status("robomaster-uart", port=path) == "fail"


def test_what_is_no_serial_line_is_a_failure(tmp_path):
    (tmp_path / "file").touch()
    assert "not a serial line" in check_serial(str(tmp_path / "file")).text
    assert "plug it in" in check_serial(str(tmp_path / "nowhere")).text


def test_a_serial_line_of_others_names_the_group_to_join(monkeypatch, serial_line):
    def refuse(*_):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(os, "open", refuse)
    found = check_serial(serial_line[0])
    assert found.status == "fail"
    assert "usermod -aG" in found.text


def test_a_host_that_takes_connections_passes_and_gets_no_byte():
    push_port = free_udp_port()
    with socket.socket() as robot:
        robot.bind(("127.0.0.1", 0))
        robot.listen()
        port = robot.getsockname()[1]
        assert status("robomaster-tcp", host="127.0.0.1", port=port, push_port=push_port) == "pass"
        assert status("mavlink", endpoint=f"tcp:127.0.0.1:{port}", profile="px4") == "pass"
        for _ in range(2):
            connection, _ = robot.accept()
            with connection:
                assert connection.recv(1) == b""


def test_a_host_that_answers_nobody_is_a_failure():
    push_port = free_udp_port()
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        port = nobody.getsockname()[1]
        found = check_link("robomaster-tcp", {"host": "127.0.0.1", "port": port, "push_port": push_port})
    assert found.status == "fail"
    assert "switch the robot on" in found.text


def test_a_port_that_another_program_listens_at_is_a_failure():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        assert status("mavlink", endpoint=f"udpin:127.0.0.1:{port}", profile="copter") == "fail"
        assert status("robomaster-tcp", host="127.0.0.1", port=1, push_port=port) == "fail"
    assert status("mavlink", endpoint=f"udpin:127.0.0.1:{port}", profile="copter") == "pass"


def test_a_way_out_needs_a_host_that_is_known():
    assert status("mavlink", endpoint="udpout:127.0.0.1:14550", profile="copter") == "pass"


def test_a_bus_at_another_bit_rate_than_the_robot_s_is_a_failure():
    found = check_link("robomaster-can", {"interface": "socketcan", "channel": "can0", "bitrate": 500_000})
    assert found.status == "fail"
    assert "1000000" in found.text


def test_adapters_that_cannot_be_looked_at_are_a_warning():
    assert status("robomaster-can", interface="pcan", channel="PCAN_USBBUS1") == "warn"
    assert status("robomaster-can", channel="can0") == "warn"
    assert status("robomaster-can", interface="virtual", channel="test") == "pass"


@pytest.mark.parametrize(
    ("kind", "missing", "options"),
    [
        ("robomaster-can", "can", {"interface": "virtual", "channel": "x"}),
        ("robomaster-uart", "serial", {"port": "/dev/null"}),
        ("mavlink", "pymavlink", {"endpoint": "udpin:127.0.0.1:1", "profile": "copter"}),
    ],
)
def test_a_library_that_is_missing_is_named(monkeypatch, kind, missing, options):
    monkeypatch.setattr("mtm_onboard.doctor.link.find_spec", lambda name: None if name == missing else object())
    found = check_link(kind, options)
    assert found.status == "fail"
    assert "install" in found.text


names = st.sampled_from(
    ["interface", "channel", "bitrate", "port", "host", "push_port", "endpoint", "profile", "baud", "x"]
)
values = st.sampled_from(["socketcan", "..", "", "copter", "px4", "tcp:127.0.0.1:1", "/dev/null", "127.0.0.1"])
options = st.dictionaries(names, values | st.integers(-2, 70_000) | st.booleans() | st.floats(), max_size=4)


@given(st.sampled_from(sorted(factory._KINDS)), options)
def test_whatever_the_options_there_is_one_finding(kind, options):
    # A network that is not there would be waited for.
    if options.get("host") not in (None, "127.0.0.1"):
        options["host"] = "127.0.0.1"
    assert check_link(kind, options).check == "link"


def free_udp_port() -> int:
    """A number that nobody had a moment ago."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
