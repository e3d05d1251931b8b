import os
import socket
import time
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.links.base import LinkBusyError
from mtm_onboard.links.byte_stream import ByteStream, serial_stream, tcp_stream
from mtm_onboard.protocol import MtmError
from tests.onboard.links.stalled_line import StalledLine
from tests.patience import PATIENCE_S


@pytest.fixture
def ends():
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    yield ByteStream(ours.fileno(), ours.close), theirs
    ours.close()
    theirs.close()


def drained(end):
    data = b""
    try:
        while part := end.recv(65_536):
            data += part
    except BlockingIOError:
        pass
    return data


def filled(link):
    """Write until the line takes nothing more, and return what it took in whole messages."""
    taken = b""
    for number in range(100_000):
        message = f"filling {number};".encode()
        try:
            link.write(message, 0.0)
        except MtmError:
            return taken
        taken += message
    raise AssertionError("the line never filled")


def test_a_message_arrives_whole_and_is_counted(ends):
    link, far = ends
    link.write(b"one;", 0.0)
    link.write(b"two;", 0.0)
    assert drained(far) == b"one;two;"
    assert link.sent_bytes == 8


def test_a_blocked_line_is_one_sentence_within_the_bound(ends, monkeypatch):
    link, _ = ends
    filled(link)
    line = StalledLine().install(monkeypatch)
    with pytest.raises(MtmError, match="took no command in time"):
        link.write(b"late;", 0.005)
    assert line.waited_s == 0.005


def test_a_message_that_could_not_begin_to_leave_is_forgotten(ends):
    link, far = ends
    taken = filled(link)
    for _ in range(3):
        with pytest.raises(MtmError):
            link.write(b"stale;", 0.0)
    arrived = drained(far)
    link.write(b"fresh;", 0.0)
    arrived += drained(far)
    # One message may have left in part when the line filled; it is finished.
    pieces = arrived.removeprefix(taken).split(b";")
    assert pieces[-2:] == [b"fresh", b""]
    assert len(pieces) <= 3
    assert b"stale" not in arrived


@given(st.lists(st.tuples(st.integers(1, 3000), st.integers(0, 4000)), min_size=1, max_size=40))
def test_no_message_follows_half_of_another(steps):
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)
        theirs.setblocking(False)
        link = ByteStream(ours.fileno(), ours.close)
        arrived, tried, written = b"", [], set()
        for number, (length, read) in enumerate(steps):
            message = f"{number}{'x' * length};".encode()
            tried.append(message)
            try:
                link.write(message, 0.0)
                written.add(message)
            except LinkBusyError as error:
                if error.has_begun:
                    written.add(message)
            if read:
                with suppress(BlockingIOError):
                    arrived += theirs.recv(read)
        while True:
            arrived += drained(theirs)
            try:
                link.write(b"end;", 0.0)
                break
            except MtmError:
                pass
        arrived += drained(theirs)
        assert arrived.endswith(b"end;")
        whole = [part + b";" for part in arrived.split(b";")[:-2]]
        assert whole == [message for message in tried if message in set(whole)]
        # What was taken, or has at least begun to leave, arrives, and nothing else does.
        assert set(whole) == written


def test_a_silent_line_reads_as_nothing_and_a_closed_one_says_so(ends):
    link, far = ends
    assert link.read() == b""
    far.send(b"bye;")
    far.close()
    assert link.read() == b"bye;"
    with pytest.raises(MtmError, match="closed the link"):
        link.read()
    with pytest.raises(MtmError, match="refused a command"):
        link.write(b"anybody?;", 0.0)


def test_a_babbling_far_end_does_not_hold_its_reader(ends):
    link, far = ends
    filled(ByteStream(far.fileno(), lambda: None))
    assert len(link.read()) <= 16 * 4096


def test_a_closed_link_neither_reads_nor_writes(ends):
    link, _ = ends
    link.close()
    link.close()
    assert link.read() == b""
    with pytest.raises(MtmError, match="closed"):
        link.write(b"x;", 0.0)


def test_a_serial_line_carries_every_byte_both_ways_unchanged():
    ours, theirs = os.openpty()
    link, far = serial_stream(os.ttyname(theirs), 115_200), ByteStream(ours)
    try:
        every = bytes(range(256))
        link.write(every, 0.1)
        far.write(every, 0.1)
        deadline_s, there, here = time.monotonic() + PATIENCE_S, b"", b""
        while len(there + here) < 512 and time.monotonic() < deadline_s:
            there += far.read()
            here += link.read()
        assert (there, here) == (every, every)
    finally:
        link.close()
        far.close()
        os.close(theirs)


@pytest.mark.parametrize("port", ["/dev/there-is-none", "/dev/null"])
def test_a_serial_line_that_cannot_be_opened_is_one_sentence(port):
    with pytest.raises(MtmError, match=f"{port} cannot be opened"):
        serial_stream(port, 115_200)


@pytest.mark.parametrize("port", [1, 70_000])
def test_a_robot_that_nobody_reaches_is_one_sentence(port):
    with pytest.raises(MtmError, match=f"127.0.0.1 port {port} cannot be reached"):
        tcp_stream("127.0.0.1", port)


def test_closing_does_not_recall_the_last_command():
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = tcp_stream(*server.getsockname())
        far, _ = server.accept()
        with far:
            far.send(b"ok;ok;ok;")
            link.write(b"stop;", 0.1)
            link.close()
            assert far.recv(100) == b"stop;"
