"""Who judges looks: a process beside the watch, so that tracking never waits, or the watch itself."""

import multiprocessing
import os
import signal
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Protocol

from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.live.judging import Judged, Seen, judge
from mtm_audit.live.looks import Look
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import Key

# Tracking comes first where there is one core for both.
_NICENESS = 5


class Judge(Protocol):
    """Takes one look at a time."""

    @property
    def is_busy(self) -> bool:
        """Whether a look is being judged."""
        ...

    def begin(self, look: Look, seen: Seen) -> None:
        """Begin to judge a look; there must be none."""
        ...

    def finished(self) -> Judged | None:
        """What the look gave, once; None while it is being judged, or there is none."""
        ...

    def wait(self) -> None:
        """Return when the look has been judged."""
        ...

    def close(self) -> None:
        """Give up what is being judged."""
        ...


class JudgeHere:
    """Judges at once, which takes no time of a simulated watch."""

    def __init__(self, key: Key, settings: DecodeSettings) -> None:
        self._key, self._settings = key, settings
        self._judged: Judged | None = None

    @property
    def is_busy(self) -> bool:
        """Until the result was taken."""
        return self._judged is not None

    def begin(self, look: Look, seen: Seen) -> None:
        """Judge it."""
        self._judged = judge(look, seen, self._key, self._settings)

    def finished(self) -> Judged | None:
        """What the look gave."""
        judged, self._judged = self._judged, None
        return judged

    def wait(self) -> None:
        """Nothing is waited for."""

    def close(self) -> None:
        """Nothing is running."""


class JudgeBeside:
    """Judges in a process of its own, at a lower priority."""

    def __init__(self, key: Key, settings: DecodeSettings) -> None:
        self._start: Callable[[], ProcessPoolExecutor] = lambda: ProcessPoolExecutor(
            1, multiprocessing.get_context("spawn"), _prepare, (key, settings)
        )
        self._pool = self._start()
        # The process starts, and loads what judging needs, before there is anything to judge.
        self._future: Future[Judged | None] | None = self._pool.submit(_nothing)
        self._failures = 0

    @property
    def is_busy(self) -> bool:
        """Until the result was taken."""
        return self._future is not None

    def begin(self, look: Look, seen: Seen) -> None:
        """Hand the look over, to a new process where the last one is gone."""
        try:
            self._future = self._pool.submit(_judge_there, look, seen)
        except BrokenProcessPool:
            self._pool = self._start()
            self._future = self._pool.submit(_judge_there, look, seen)

    def finished(self) -> Judged | None:
        """What the look gave; a look whose process was ended from outside gives nothing.

        Raises MtmError when that happens again and again.
        """
        if self._future is None or not self._future.done():
            return None
        future, self._future = self._future, None
        try:
            judged = future.result()
        except BrokenProcessPool as error:
            self._failures += 1
            if self._failures > 2:
                raise MtmError(
                    "the process that judges looks is ended from outside each time; give it more memory, or record and "
                    "decode"
                ) from error
            self._pool = self._start()
            return None
        self._failures = 0
        return judged

    def wait(self) -> None:
        """Return when the look has been judged."""
        if self._future is not None:
            self._future.exception()

    def close(self) -> None:
        """End the process, whatever it is at."""
        # Its own way of ending waits for the look that is being judged.
        processes = list((self._pool._processes or {}).values())
        for process in processes:
            process.terminate()
        self._pool.shutdown(cancel_futures=True)


_key: Key | None = None
_settings: DecodeSettings | None = None


def _prepare(key: Key, settings: DecodeSettings) -> None:
    global _key, _settings
    _key, _settings = key, settings
    # An interrupt at the keyboard reaches both; the watch ends this one.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(_NICENESS)


def _nothing() -> Judged | None:
    return None


def _judge_there(look: Look, seen: Seen) -> Judged | None:
    assert _key is not None
    assert _settings is not None
    return judge(look, seen, _key, _settings)
