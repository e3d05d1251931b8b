"""A plaintext line inside one process, for simulations that run faster than real time."""

import socket

from hil.wires.plaintext_ports import LinePort
from mtm_onboard.links.byte_stream import ByteStream
from mtm_onboard.links.robomaster_plaintext import RoboMasterPlaintext


class LineLink(RoboMasterPlaintext):
    """A RoboMaster EP at the far end of `link`, which serves for one `open` and is closed by `close`."""

    def __init__(self, link: ByteStream) -> None:
        super().__init__()
        self._given_link = link

    def _connect(self) -> ByteStream:
        return self._given_link


def plaintext_line() -> tuple[LineLink, LinePort]:
    """Both ends of a new line; what one sends is there for the other at once."""
    ours, theirs = socket.socketpair()
    return LineLink(ByteStream(ours.detach())), LinePort(theirs.detach())
