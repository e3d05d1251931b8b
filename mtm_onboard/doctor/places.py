"""The files and sockets of a run: the key, the journal, the control socket, where base commands come from."""

import os
import pwd
import shutil
import stat
import tempfile
from pathlib import Path

from mtm_onboard.control.control_socket import ControlSocket
from mtm_onboard.doctor.finding import Finding
from mtm_onboard.protocol import MtmError
from mtm_onboard.runtime.config import ControlSettings, JournalSettings, SourceSettings
from mtm_onboard.runtime.datagram_source import UdpSource, UnixSource

# Where systemd makes a service's folder when it starts it.
_RUNTIME_FOLDERS = Path("/run")


def check_key_file(path: Path) -> Finding:
    """Check the owner of a key file that could be loaded, and whether others may replace it."""
    owner, user = path.stat().st_uid, os.getuid()
    folder = path.resolve().parent
    mode = folder.stat().st_mode
    if mode & 0o022 and not mode & stat.S_ISVTX:
        return Finding(
            "key",
            "warn",
            f"others may put another key into {folder} (mode {mode & 0o777:04o}); run: chmod go-w {folder}",
        )
    if owner != user:
        return Finding(
            "key", "warn",
            f"{path} belongs to {_user(owner)}, and what {_user(user)} may do says nothing of that user; "
            f"run: sudo -u {_user(owner)} mtm-onboard doctor",
        )  # fmt: skip
    return Finding("key", "pass", f"{path} is readable by {_user(user)} alone")


def check_journal(settings: JournalSettings | None) -> Finding:
    """Check that the folder is writable and the disk has room for the whole journal."""
    if settings is None:
        return Finding("journal", "pass", "none is kept, as the configuration says")
    folder = Path(settings.path).parent
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
        free_mb = shutil.disk_usage(folder).free / 1e6
    except OSError as error:
        return Finding(
            "journal", "fail", f"{folder.resolve()} takes no file ({error.strerror}); make it and give it to this user"
        )
    figures = {"free_mb": round(free_mb, 1), "max_mb": settings.max_mb}
    if free_mb < settings.max_mb:
        return Finding(
            "journal", "warn",
            f"it may grow to {settings.max_mb:g} MB and {folder.resolve()} has {free_mb:.0f} MB free; make room or "
            "lower max_mb", figures,
        )  # fmt: skip
    return Finding(
        "journal", "pass", f"{folder.resolve()} has {free_mb:.0f} MB free, {settings.max_mb:g} are kept", figures
    )


def check_control(settings: ControlSettings | None) -> Finding:
    """Check that the control socket can be made; one left by a crash is removed, as the run does."""
    if settings is None:
        return Finding("control", "pass", "no control socket, as the configuration says")
    path = Path(settings.socket)
    if missing := _missing_runtime_folder("control", path):
        return missing
    try:
        ControlSocket(path).close()
    except MtmError as error:
        return Finding("control", "fail", str(error))
    return Finding("control", "pass", f"{path} is free")


def check_source(settings: SourceSettings) -> Finding:
    """The base commands' socket can be made, or their port is free."""
    path, port = settings.socket, settings.port
    if path is not None and (missing := _missing_runtime_folder("source", Path(path))):
        return missing
    try:
        if path is not None:
            UnixSource(Path(path)).close()
        if port is not None:
            UdpSource(port).close()
    except MtmError as error:
        return Finding("source", "fail", f"{error}, or end the run that listens there")
    return Finding("source", "pass", f"base commands can come from {settings}")


def _missing_runtime_folder(name: str, path: Path) -> Finding | None:
    if not path.is_relative_to(_RUNTIME_FOLDERS) or path.parent.exists():
        return None
    return Finding(
        name, "warn",
        f"{path.parent} is not there yet; mtm-onboard@.service makes its own, {_RUNTIME_FOLDERS}/mtm, when it "
        "starts, and any other folder is yours to make",
    )  # fmt: skip


def _user(number: int) -> str:
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return f"user {number}"
