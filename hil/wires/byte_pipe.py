"""A byte pipe with two ends inside one process, for simulations that run faster than real time."""

from mtm_onboard.protocol import MtmError


class PipeEnd:
    """One end: what it writes, the other reads, in the pieces in which it was written.

    `sent` counts its bytes. `is_cut` takes the wire away from this end: writing raises MtmError, nothing is read.
    """

    def __init__(self, inbox: list[bytes], outbox: list[bytes]) -> None:
        self.sent = 0
        self.is_cut = False
        self._inbox = inbox
        self._outbox = outbox

    def write(self, data: bytes) -> None:
        """Give bytes to the other end; raises MtmError while the wire is cut."""
        if self.is_cut:
            raise MtmError("the wire is cut")
        self.sent += len(data)
        self._outbox.append(data)

    def read(self) -> bytes:
        """The next piece, empty when there is none; never waits."""
        return self._inbox.pop(0) if self._inbox and not self.is_cut else b""

    def keep_sender(self) -> None:
        """A pipe has one other end."""

    def close(self) -> None:
        """There is nothing to release; the end can be used again."""


def byte_pipe() -> tuple[PipeEnd, PipeEnd]:
    """Both ends of a new pipe."""
    one: list[bytes] = []
    two: list[bytes] = []
    return PipeEnd(one, two), PipeEnd(two, one)
