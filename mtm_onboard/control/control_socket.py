"""The control socket: requests to a running robot, one JSON line each, answered by one JSON line.

A Unix stream socket that only its owner can open. Whatever a client does, it is done to threads of the socket's own:
a line has a limit, a connection a deadline, and the newest connections push out the oldest, so that a client which
keeps silent holds up neither the loop nor the operator's stop.
"""

import json
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.runtime.socket_file import SocketFile

Table = dict[str, Any]

LONGEST_BYTES = 16_384
_DEADLINE_S = 2.0
_MOST_CONNECTIONS = 8
_BACKLOG = 64
# Bounds what a flood of connections costs the loop's process.
_ACCEPT_PAUSE_S = 0.01
_POLL_S = 0.2
_CLIENT_PATIENCE_S = 15.0


class ControlSocket:
    """Listens at `path` from construction on; `serve` answers. Leaving it as a context manager removes the socket.

    A socket that nobody listens at, left by a crash, is replaced. Raises MtmError when somebody does, when `path` is
    something else, and when it cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self._file = SocketFile(path, socket.SOCK_STREAM, 0o600, "control socket")
        self._listener = self._file.socket
        self._listener.listen(_BACKLOG)
        self._listener.settimeout(_POLL_S)
        self._ending = threading.Event()
        self._connections: deque[socket.socket] = deque()
        self._thread: threading.Thread | None = None

    def serve(self, answer: Callable[[Table], Table]) -> None:
        """Answer requests from now on; `answer` is called from several threads, and clients are told its errors."""
        self._thread = threading.Thread(target=self._accept, args=(answer,), name="control", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening and remove the socket, unless another has taken its name; safe to call more than once."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join()
        self._file.close()
        for connection in list(self._connections):
            _shut(connection)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _accept(self, answer: Callable[[Table], Table]) -> None:
        while not self._ending.is_set():
            try:
                connection, _ = self._listener.accept()
            except OSError:
                # Nobody came within the poll, or there is no descriptor to spare for them.
                self._ending.wait(_ACCEPT_PAUSE_S)
                continue
            with suppress(IndexError):
                while len(self._connections) >= _MOST_CONNECTIONS:
                    _shut(self._connections.popleft())
            self._connections.append(connection)
            threading.Thread(target=self._talk, args=(connection, answer), name="control client", daemon=True).start()
            self._ending.wait(_ACCEPT_PAUSE_S)

    def _talk(self, connection: socket.socket, answer: Callable[[Table], Table]) -> None:
        with connection, suppress(OSError):
            line = _read_line(connection, time.monotonic() + _DEADLINE_S)
            if line:
                connection.settimeout(_DEADLINE_S)
                connection.sendall(json.dumps(_answered(line, answer)).encode() + b"\n")
        with suppress(ValueError):
            self._connections.remove(connection)


def ask(path: Path, request: Table) -> Table:
    """The answer of the robot that listens at `path`; raises MtmError when there is none or it says that it cannot."""
    deadline_s = time.monotonic() + _CLIENT_PATIENCE_S
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            _connect(connection, path, deadline_s)
            connection.sendall(json.dumps(request).encode() + b"\n")
            line = _read_line(connection, deadline_s)
    except OSError as error:
        raise MtmError(
            f"no running robot answers at {path} ({error.strerror or error}); start mtm-onboard run with "
            "[control] socket in its configuration"
        ) from error
    try:
        answer = json.loads(line)
        ok = answer.pop("ok")
    except (ValueError, TypeError, AttributeError, KeyError) as error:
        raise MtmError(f"what listens at {path} gave no answer of a robot; check the path") from error
    if not ok:
        raise MtmError(str(answer.get("error")))
    return dict(answer)


def _connect(connection: socket.socket, path: Path, deadline_s: float) -> None:
    connection.settimeout(_CLIENT_PATIENCE_S)
    while True:
        try:
            connection.connect(str(path))
            return
        except BlockingIOError:
            # A queue that is full refuses at once whoever has a timeout.
            if time.monotonic() > deadline_s:
                raise
            time.sleep(_ACCEPT_PAUSE_S)


def _answered(line: bytes, answer: Callable[[Table], Table]) -> Table:
    try:
        request = json.loads(line)
        if not isinstance(request, dict):
            raise ValueError
    except (ValueError, RecursionError):
        return {"ok": False, "error": 'this is no request; send one line of JSON such as {"command": "status"}'}
    try:
        return {"ok": True} | answer(request)
    except MtmError as error:
        return {"ok": False, "error": str(error)}
    except Exception as error:
        return {"ok": False, "error": f"the request failed ({error!r}); the robot goes on as before"}


def _read_line(connection: socket.socket, deadline_s: float) -> bytes:
    """Up to the first newline; empty when the peer ends before it, or sends more than a line may have."""
    data = b""
    while b"\n" not in data:
        if len(data) > LONGEST_BYTES:
            return b""
        connection.settimeout(max(1e-3, deadline_s - time.monotonic()))
        received = connection.recv(4096)
        if not received or time.monotonic() > deadline_s:
            return b""
        data += received
    return data.split(b"\n", 1)[0]


def _shut(connection: socket.socket) -> None:
    with suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)
