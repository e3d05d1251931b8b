import json
import os
import socket
import stat
import threading
from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mtm_onboard.control import control_socket as controlsocket
from mtm_onboard.control.control_socket import LONGEST_BYTES, ControlSocket, ask
from mtm_onboard.protocol import MtmError
from tests.patience import PATIENCE_S


def echo(request):
    if "fail" in request:
        raise ValueError("broken")
    if "refuse" in request:
        raise MtmError("this is refused; ask for something else")
    return {"echo": request}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "robot.sock"


@pytest.fixture
def listening(path):
    with ControlSocket(path) as control:
        control.serve(echo)
        yield path


def raw(path, data: bytes) -> bytes:
    """What comes back for bytes that may be no request."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(PATIENCE_S)
        connection.connect(str(path))
        parts = []
        # The other end may close while this one still sends.
        with suppress(ConnectionError):
            connection.sendall(data)
            connection.shutdown(socket.SHUT_WR)
            while part := connection.recv(4096):
                parts.append(part)
        return b"".join(parts)


def test_a_request_is_answered_and_only_the_owner_can_ask(listening):
    assert ask(listening, {"command": "status"}) == {"echo": {"command": "status"}}
    assert stat.S_IMODE(os.lstat(listening).st_mode) == 0o600


def test_errors_reach_the_client_as_one_sentence(listening):
    with pytest.raises(MtmError, match="^this is refused; ask for something else$"):
        ask(listening, {"refuse": 1})
    with pytest.raises(MtmError, match="broken"):
        ask(listening, {"fail": 1})
    assert ask(listening, {}) == {"echo": {}}


@pytest.mark.parametrize("line", [b"hello\n", b"[1]\n", b"\xff\xfe\n", b"[" * 10_000 + b"\n", b"7\n", b'{"a":\n'])
def test_what_is_no_request_gets_an_answer_that_says_so(listening, line):
    answer = json.loads(raw(listening, line))
    assert not answer["ok"]
    assert "JSON" in answer["error"]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25)
@given(st.binary(max_size=200))
def test_whatever_is_sent_the_next_request_is_answered(listening, data):
    raw(listening, data)
    assert ask(listening, {"n": 1}) == {"echo": {"n": 1}}


def test_a_line_without_an_end_is_cut_off(listening):
    assert raw(listening, b"x" * (4 * LONGEST_BYTES)) == b""
    assert ask(listening, {}) == {"echo": {}}


def test_a_client_that_says_nothing_is_sent_away(path, monkeypatch):
    monkeypatch.setattr(controlsocket, "_DEADLINE_S", 0.05)
    with ControlSocket(path) as control, socket.socket(socket.AF_UNIX) as silent:
        control.serve(echo)
        silent.connect(str(path))
        silent.sendall(b"{")
        silent.settimeout(PATIENCE_S)
        assert silent.recv(1) == b""


def test_clients_that_say_nothing_do_not_keep_out_the_operator(path, monkeypatch):
    # None of them is sent away while this test lasts.
    monkeypatch.setattr(controlsocket, "_DEADLINE_S", 2 * PATIENCE_S)
    monkeypatch.setattr(controlsocket, "_CLIENT_PATIENCE_S", PATIENCE_S)
    silent = [socket.socket(socket.AF_UNIX) for _ in range(60)]
    with ControlSocket(path) as control:
        control.serve(echo)
        for one in silent:
            one.connect(str(path))
        assert ask(path, {"command": "stop"}) == {"echo": {"command": "stop"}}
        for one in silent:
            one.close()


def test_a_request_that_takes_long_holds_up_no_other(path):
    released = threading.Event()

    def slow(request):
        if "slow" in request:
            released.wait(PATIENCE_S)
        return {}

    with ControlSocket(path) as control:
        control.serve(slow)
        waiting = threading.Thread(target=ask, args=(path, {"slow": 1}))
        waiting.start()
        assert ask(path, {}) == {}
        assert waiting.is_alive()
        released.set()
        waiting.join()


def test_the_socket_is_removed_at_the_end(path):
    with ControlSocket(path):
        assert path.exists()
    assert not path.exists()


def test_a_socket_left_by_a_crash_is_replaced(path):
    with socket.socket(socket.AF_UNIX) as crashed:
        crashed.bind(str(path))
    with ControlSocket(path) as control:
        control.serve(echo)
        assert ask(path, {}) == {"echo": {}}


def test_a_socket_that_another_run_listens_at_is_left_to_it(listening):
    with pytest.raises(MtmError, match="another run listens"):
        ControlSocket(listening)
    assert ask(listening, {}) == {"echo": {}}


def test_a_file_in_the_socket_s_place_is_refused_and_left_alone(path):
    path.write_text("precious")
    with pytest.raises(MtmError, match="no socket"):
        ControlSocket(path)
    assert path.read_text() == "precious"


def test_a_socket_that_has_taken_the_name_is_not_removed(path):
    first = ControlSocket(path)
    path.unlink()
    with ControlSocket(path):
        first.close()
        assert path.exists()


@pytest.mark.parametrize("name", ["no/robot.sock", "x" * 200])
def test_a_path_that_cannot_be_is_refused_in_one_sentence(tmp_path, name):
    with pytest.raises(MtmError, match="choose"):
        ControlSocket(tmp_path / name)


def test_asking_where_no_robot_runs_says_so(path):
    with pytest.raises(MtmError, match="no running robot"):
        ask(path, {})


@pytest.mark.parametrize("answer", [b"", b"hello\n", b"[]\n", b"{}\n"])
def test_an_answer_that_is_none_of_a_robot_s_says_so(path, answer):
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(path))
        listener.listen()

        def reply() -> None:
            connection, _ = listener.accept()
            with connection:
                connection.recv(100)
                connection.sendall(answer)

        replying = threading.Thread(target=reply)
        replying.start()
        with pytest.raises(MtmError, match="no answer of a robot"):
            ask(path, {})
        replying.join()
