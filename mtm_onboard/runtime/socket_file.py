"""Unix sockets that have a name in the file system, and who may open them."""

import os
import socket
import stat
from contextlib import suppress
from pathlib import Path

from mtm_onboard.protocol.errors import MtmError

_PATIENCE_S = 2.0


class SocketFile:
    """A Unix socket of the kind `kind`, bound at `path` with the permissions `mode`; `close` removes it.

    A socket that nobody listens at, left by a crash, is replaced. `what` names it in errors, such as "control socket".
    Raises MtmError when somebody does, when `path` is something else, and when it cannot be made.
    """

    def __init__(self, path: Path, kind: socket.SocketKind, mode: int, what: str) -> None:
        _clear(path, kind, what)
        self.path = path
        self.socket = socket.socket(socket.AF_UNIX, kind)
        try:
            # Before it has a name, so that at no moment anybody else could connect; the umask may have taken more.
            os.fchmod(self.socket.fileno(), mode)
            self.socket.bind(str(path))
            os.chmod(path, mode)
            self._identity = _identity(path)
        except OSError as error:
            self.socket.close()
            reason = error.strerror or error
            raise MtmError(
                f"cannot make the {what} {path}: {reason}; choose a short path in a folder that is writable"
            ) from error

    def close(self) -> None:
        """Close it and remove its name, unless another has taken it; safe to call more than once."""
        self.socket.close()
        with suppress(OSError):
            if _identity(self.path) == self._identity:
                self.path.unlink()


def _clear(path: Path, kind: socket.SocketKind, what: str) -> None:
    """Remove a socket that nobody listens at; raises MtmError for anything else that stands at `path`."""
    try:
        if not stat.S_ISSOCK(path.lstat().st_mode):
            raise MtmError(f"{path} is there already and is no socket; choose another path for the {what}")
        with socket.socket(socket.AF_UNIX, kind) as probe:
            probe.settimeout(_PATIENCE_S)
            probe.connect(str(path))
    except FileNotFoundError:
        return
    except ConnectionRefusedError:
        with suppress(FileNotFoundError):
            path.unlink()
        return
    except OSError as error:
        raise MtmError(
            f"cannot tell who has the {what} {path} ({error.strerror or error}); remove it or choose another"
        ) from error
    raise MtmError(f"another run listens at the {what} {path}; end it first, or give this one another path")


def _identity(path: Path) -> tuple[int, int]:
    status = path.lstat()
    return status.st_dev, status.st_ino
