"""Of which files a report is, and what made it: hashes, command line, time, versions."""

import hashlib
import platform
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version
from pathlib import Path

from mtm_audit.reporting.subject import dated, now
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.installing import DISTRIBUTION

_MOST_LISTED = 20
# Modules whose version may matter, with the names by which people know them; told when they were loaded.
_LIBRARIES = {"numpy": "NumPy", "scipy": "SciPy", "cv2": "OpenCV", "av": "PyAV"}


@dataclass(frozen=True)
class ReportRequest:
    """Where to write the report, the `arguments` that asked for it, and what beside the recording went into the answer.

    `inputs` are names of things and their files, the key's among them; `began` is when the work began.
    """

    path: Path
    arguments: tuple[str, ...]
    inputs: tuple[tuple[str, Path], ...]
    began: datetime

    @property
    def command(self) -> str:
        """The command line as a shell takes it."""
        return shlex.join(("mtm-audit", *self.arguments))


def requested(path: Path, arguments: Sequence[str] | None, inputs: dict[str, Path | None]) -> ReportRequest:
    """A report that is asked for now; without `arguments` the process's own. Inputs that were not given are None."""
    words = sys.argv[1:] if arguments is None else arguments
    named = tuple((name, file) for name, file in inputs.items() if file is not None)
    return ReportRequest(path, tuple(words), named, now())


@dataclass(frozen=True)
class HashedFile:
    """A file by what it was given as, its name, its SHA-256 in hexadecimal digits and its size."""

    what: str
    name: str
    sha256: str
    size_bytes: int


@dataclass(frozen=True)
class Provenance:
    """`files` with their hashes; `facts` are what a reader needs to do the same again, each with its name.

    `warnings` name files that were written to while they were read, whose hashes may be those of something else.
    """

    files: tuple[HashedFile, ...]
    facts: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]


def provenance_of(request: ReportRequest, recording: Sequence[Path]) -> Provenance:
    """Hash what was read and name what read it; raises MtmError when a file cannot be read any more."""
    films = _files_of(recording)
    changed = [path for path in (*films, *(path for _, path in request.inputs)) if _written_since(path, request.began)]
    return Provenance(
        files=(*_hashed_recording(films), *(hashed(what, path) for what, path in request.inputs)),
        facts=(
            ("command", request.command),
            ("decoded", f"{dated(request.began)} ({request.began.tzname() or 'local time'})"),
            ("versions", ", ".join(f"{name} {number}" for name, number in versions().items())),
            ("machine", f"{platform.system()} {platform.release()}, {platform.machine()}"),
        ),
        warnings=tuple(
            f"{path} was written to while it was read; its hash may not be that of what was decoded" for path in changed
        ),
    )


def hashed(what: str, path: Path) -> HashedFile:
    """One file with the SHA-256 of all its bytes; raises MtmError when it cannot be read."""
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
            return HashedFile(what, str(path), digest, file.tell())
    except OSError as error:
        raise MtmError(
            f"{path} cannot be read any more ({error.strerror}), so the report lacks its hash; leave files in their "
            "places until the decode has ended"
        ) from error


def versions() -> dict[str, str]:
    """Versions of ourselves, of Python and of those libraries that this run has loaded."""
    found = {DISTRIBUTION: version(DISTRIBUTION), "Python": platform.python_version()}
    for module, name in _LIBRARIES.items():
        if module in sys.modules:
            found[name] = str(getattr(sys.modules[module], "__version__", "of unknown version"))
    return found


def _files_of(recording: Sequence[Path]) -> list[Path]:
    """The files of a recording; a folder of pictures stands for what it holds."""
    return [
        file
        for path in recording
        for file in (sorted(item for item in path.iterdir() if item.is_file()) if path.is_dir() else [path])
    ]


def _hashed_recording(files: Sequence[Path]) -> list[HashedFile]:
    """A line for each file; of very many one for all, the hash of what `sha256sum *` prints in their folder."""
    each = [hashed("recording", file) for file in files]
    if len(each) <= _MOST_LISTED:
        return each
    lines = "".join(f"{item.sha256}  {file.name}\n" for item, file in zip(each, files, strict=True))
    digest = hashlib.sha256(lines.encode()).hexdigest()
    name = f"{files[0].parent} ({len(files)} files; sha256sum * | sha256sum)"
    return [HashedFile("recording", name, digest, sum(item.size_bytes for item in each))]


def _written_since(path: Path, began: datetime) -> bool:
    return path.exists() and path.stat().st_mtime > began.timestamp()
