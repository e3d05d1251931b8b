"""A source read in a thread of its own, so that a watch goes on while the source is silent, and the source while the
watch is busy.
"""

import queue
import threading
from collections.abc import Iterator
from typing import Final

from mtm_audit.live.events import Event, Notice, Quiet
from mtm_onboard.protocol.errors import MtmError

# Two seconds of pictures, which of 720p take 60 MB.
_MOST_WAITING = 64
_QUIET_S = 0.2


class _End:
    """The source has ended."""


_END: Final = _End()


class Feed:
    """Iterates over what a source tells; gives `Quiet` when there is nothing for a moment.

    While the watch falls behind, what a live source tells is lost and counted; another source waits. An MtmError of
    the source is raised where it is iterated.
    """

    def __init__(self, events: Iterator[Event], *, is_live: bool) -> None:
        self._events, self._is_live = events, is_live
        self._queue: queue.Queue[Event | MtmError | _End] = queue.Queue(_MOST_WAITING)
        self._stopped = threading.Event()
        self.lost = 0

    def __iter__(self) -> Iterator[Event]:
        # Ends with the program: a library that waits for a camera cannot be told to stop.
        thread = threading.Thread(target=self._read, name="source", daemon=True)
        thread.start()
        told = False
        while True:
            try:
                event = self._queue.get(timeout=_QUIET_S)
            except queue.Empty:
                yield Quiet()
                continue
            if isinstance(event, _End):
                return
            if isinstance(event, MtmError):
                raise event
            yield event
            if self.lost and not told:
                told = True
                yield Notice("the machine is too slow to look at all that comes; what is left out stays unseen")

    def stop(self) -> None:
        """Read no more."""
        self._stopped.set()

    def _read(self) -> None:
        try:
            for event in self._events:
                if self._stopped.is_set():
                    return
                self._put(event)
            self._put_surely(_END)
        except MtmError as error:
            self._put_surely(error)
        except OSError as error:
            self._put_surely(MtmError(f"the source cannot be read further ({error.strerror}); watch it again"))

    def _put(self, event: Event) -> None:
        if not self._is_live or isinstance(event, Notice):
            self._put_surely(event)
            return
        try:
            self._queue.put_nowait(event)
        except queue.Full:
            self.lost += not isinstance(event, Quiet)

    def _put_surely(self, event: Event | MtmError | _End) -> None:
        while not self._stopped.is_set():
            try:
                self._queue.put(event, timeout=_QUIET_S)
                return
            except queue.Full:
                continue
