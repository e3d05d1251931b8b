"""A function of many arguments on the cores of this machine, where a process that dies takes no other's work along."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from mtm_audit.batch.lost import Lost
from mtm_onboard.protocol.errors import MtmError

T = TypeVar("T")
R = TypeVar("R")

# Numerical libraries read these when they are loaded. Several computing processes with more threads than there are
# cores slow each other down.
SINGLE_THREADED = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
# What ends a process may have been meant for another, such as when memory is short.
_TRIES = 2


def in_processes(function: Callable[[T], R], arguments: Sequence[T], count: int) -> Iterator[tuple[int, R | Lost]]:
    """Yield (place, result) as they come; `function` is one of a module, by which other processes name it.

    An argument whose process dies is tried once more, and then `Lost`. Raises MtmError when `function` raises anything.
    Leaving the iterator ends the processes at once.
    """
    waiting = [(place, 1) for place in reversed(range(len(arguments)))]
    busy: dict[Connection, tuple[_Process, int, int]] = {}

    def begin(process: _Process) -> None:
        place, number = waiting.pop()
        process.begin(arguments[place])
        busy[process.connection] = process, place, number

    try:
        for _ in range(min(count, len(arguments))):
            begin(_started(function))
        while busy:
            for connection in wait(list(busy)):
                assert isinstance(connection, Connection)
                process, place, number = busy[connection]
                try:
                    result: R | Lost = process.result()
                except EOFError:
                    result = Lost()
                del busy[connection]
                again = isinstance(result, Lost) and number < _TRIES
                if again:
                    waiting.append((place, number + 1))
                # Before the result is taken, which may take a while, so that the process need not wait for that.
                if isinstance(result, Lost) or not waiting:
                    process.end()
                if waiting:
                    begin(_started(function) if isinstance(result, Lost) else process)
                if not again:
                    yield place, result
    finally:
        for process, *_ in busy.values():
            process.end()


@dataclass(frozen=True)
class _Process:
    process: Any
    connection: Connection

    def begin(self, argument: object) -> None:
        # One that died while it was idle is found out when its result is asked for.
        with suppress(BrokenPipeError):
            self.connection.send(argument)

    def result(self) -> Any:
        """Raises EOFError when the process died, and MtmError when the function raised anything."""
        try:
            done, result = self.connection.recv()
        except ConnectionError as error:
            raise EOFError from error
        if not done:
            raise MtmError(result)
        return result

    def end(self) -> None:
        self.process.kill()
        self.process.join()
        self.connection.close()


def _started(function: Callable[[Any], object]) -> _Process:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, function), daemon=True)
    with _quiet_children():
        process.start()
    # The only other end is now the process's own, so that its death is the end of the file.
    theirs.close()
    return _Process(process, ours)


def _serve(connection: Connection, function: Callable[[Any], object]) -> None:
    _single_threaded()
    with suppress(EOFError, ConnectionError):
        while True:
            argument = connection.recv()
            try:
                answer = True, function(argument)
            except Exception as error:
                told = isinstance(error, MtmError)
                answer = False, str(error) if told else f"a worker process failed: {type(error).__name__}: {error}"
            connection.send(answer)


def _single_threaded() -> None:
    """What no variable of the environment says: OpenCV's own threads."""
    with suppress(ModuleNotFoundError):
        import cv2

        cv2.setNumThreads(1)


@contextmanager
def _quiet_children() -> Iterator[None]:
    """Start processes that compute in one thread and leave interrupts from the keyboard to this one, from the start."""
    with single_threaded_children():
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)


@contextmanager
def single_threaded_children() -> Iterator[None]:
    """Processes that start in the block have one numerical thread each."""
    former = {name: os.environ.get(name) for name in SINGLE_THREADED}
    os.environ.update(SINGLE_THREADED)
    try:
        yield
    finally:
        for name, value in former.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
