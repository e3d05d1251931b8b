"""A CAN bus with two nodes inside one process, for simulations that run faster than real time.

python-can's virtual bus serves as well, but copies each frame deeply and wakes threads, which makes the whole wire
three to four times as costly (`make bench` shows both).
"""

from collections import deque

import can


class LineEnd:
    """One node: what it sends, the other receives, unchanged and not copied; neither side may alter a frame."""

    def __init__(self, inbox: deque[can.Message], outbox: deque[can.Message]) -> None:
        self._inbox = inbox
        self._outbox = outbox
        self._is_shut_down = False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Give a frame to the other end; raises can.CanOperationError after `shutdown`."""
        self._check()
        self._outbox.append(msg)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame, or None; never waits. Raises can.CanOperationError after `shutdown`."""
        self._check()
        return self._inbox.popleft() if self._inbox else None

    def shutdown(self) -> None:
        """Leave the bus; safe to call more than once. What was sent can still be received."""
        self._is_shut_down = True

    def _check(self) -> None:
        if self._is_shut_down:
            raise can.CanOperationError("this end of the line is shut down")


def can_line() -> tuple[LineEnd, LineEnd]:
    """Both ends of a new bus."""
    one: deque[can.Message] = deque()
    two: deque[can.Message] = deque()
    return LineEnd(one, two), LineEnd(two, one)
