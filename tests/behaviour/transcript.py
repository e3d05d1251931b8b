"""All that one command did, as a text: exit code, what it said, and the files it wrote."""

import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from tests.behaviour.commands import Command
from tests.behaviour.normalise import normalised
from tests.behaviour.program import Outcome


def transcript(command: Command, outcome: Outcome, folder: Path, top: Path) -> str:
    """The text; `folder` is where the command ran, and `top`, above it, what to leave out of texts."""
    parts = [
        [f"$ {command.line}", f"exit code {outcome.exit_code}"],
        _content("stdout", outcome.stdout, top),
        _content("stderr", outcome.stderr, top),
        *(_file(folder / name, name, top) for name in command.writes),
        _others(command, folder),
    ]
    return "".join(f"{line}\n" for part in parts for line in part)


def missing(command: Command, folder: Path) -> list[str]:
    """Files that the command should have written."""
    return [name for name in command.writes if not (folder / name).is_file()]


def _file(path: Path, name: str, top: Path) -> Iterable[str]:
    if not path.is_file():
        return [f"{name} was not written"]
    return _content(f"{name}, mode {path.stat().st_mode & 0o777:04o}", path.read_bytes(), top)


def _content(title: str, data: bytes, top: Path) -> Iterator[str]:
    """Each line behind a bar, so that whatever follows the last newline shows too; a hash where it is no text."""
    text = normalised(data, top)
    if text is None:
        yield f"{title}: {len(data)} bytes, SHA-256 {hashlib.sha256(data).hexdigest()}"
        return
    yield f"{title}:"
    yield from (f"| {line}" for line in text.split("\n"))


def _others(command: Command, folder: Path) -> Iterator[str]:
    known = {*command.writes, *(target for _, target in command.copies)}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and name not in known:
            yield f"{name}: written and not compared"
