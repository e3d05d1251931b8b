"""What the tests against other people's programs share: where these are, and when there are none."""

import os
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PEERS = ROOT / ".peers"


def installed(group: str, program: str = "bin/python") -> Path:
    """A program of the group, or the test is skipped with the reason why there is none."""
    path = PEERS / group / program
    if not (PEERS / f"{group}.installed").exists() or not path.exists():
        reason = PEERS / f"{group}.reason"
        pytest.skip(reason.read_text() if reason.exists() else f"{group} is not installed; run make peers")
    return path


class Process:
    """A program in a process of its own whose output is kept line by line as it comes."""

    def __init__(self, command: list[object], **environment: str) -> None:
        self.lines: list[str] = []
        self._process = subprocess.Popen(
            list(map(str, command)), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"} | environment, cwd=ROOT,
        )  # fmt: skip
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.lines.append(line.rstrip("\n"))

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def output(self) -> str:
        return "\n".join(self.lines)

    def say(self, line: str) -> None:
        assert self._process.stdin is not None
        print(line, file=self._process.stdin, flush=True)

    def wait_for(self, words: str, seconds: float = 30.0) -> str:
        """The first line that has the words in it."""
        found: list[str] = []

        def look() -> bool:
            found[:] = [line for line in list(self.lines) if words in line]
            return bool(found) or self._process.poll() is not None

        until(look, seconds)
        assert found, f"{words!r} never came in:\n{self.output}"
        return found[0]

    def signal(self, number: int) -> None:
        self._process.send_signal(number)

    def end(self, seconds: float = 30.0) -> int:
        """Wait for the end, and bring it about when it does not come; the exit code."""
        try:
            code = self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            raise
        self._reader.join(5.0)
        return code

    def close(self) -> None:
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        self._reader.join(5.0)
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()


def until(true: Callable[[], bool], seconds: float) -> bool:
    """Wait for something to become true, so long at most; whether it has."""
    deadline_s = time.monotonic() + seconds
    while not true():
        if time.monotonic() > deadline_s:
            return False
        time.sleep(0.01)
    return True


@contextmanager
def polled(poll: Callable[[float], None]) -> Iterator[None]:
    """Have a simulated robot do what is due, a hundred times a second, while the block runs."""
    ending, failures = threading.Event(), []

    def run() -> None:
        began_s = time.monotonic()
        try:
            while not ending.wait(0.005):
                poll(time.monotonic() - began_s)
        except BaseException as error:
            failures.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join(10.0)
    assert not failures, failures


@pytest.fixture
def start() -> Iterator[Callable[..., Process]]:
    """Start processes that end with the test."""
    started: list[Process] = []

    def start(*command: object, **environment: str) -> Process:
        started.append(Process(list(command), **environment))
        return started[-1]

    yield start
    for process in started:
        process.close()
