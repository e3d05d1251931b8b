"""The key tree of key format 2: one master, and below it a fleet's days and each day's channels.

    fleet      F     = stream(master, "fleet", fingerprint, id words)
    chain      C_z   = stream(F, "chain", fingerprint, first, last),  z the last day
               C_d-1 = stream(C_d, "step", fingerprint, d - 1),       down to the anchor C_first-1, which is public
    day        D_d   = stream(C_d, "day", fingerprint, d)
    channel    K_d,c = stream(D_d, "channel", fingerprint, d, c)
    tags       T_d   = stream(D_d, "tags", fingerprint, d)

`stream` is the keyed function of `keystream`, and each value has 32 bytes. `fingerprint` is the scheme's, as the number
that its sixteen digits spell; a day is numbered by its epoch, see `slots`; a channel by its place in the scheme; the id
words are the SHA-256 of the key's name as four 64-bit numbers, least significant byte first. Who holds a value can
compute what is below it and nothing else: not the day after, not another channel. The waveforms of a channel come from
K as those of format 1 come from the one secret.
"""

import hashlib
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from mtm_onboard.protocol.keystream import SECRET_BYTES, stream
from mtm_onboard.protocol.scheme import Scheme


@dataclass(frozen=True)
class Tree:
    """What every value of a key's tree is bound to: the key's name and the scheme's fingerprint."""

    key_id: str
    fingerprint: str

    @property
    def number(self) -> int:
        """The fingerprint as a number of 64 bits."""
        return int(self.fingerprint, 16)

    @property
    def id_words(self) -> tuple[int, ...]:
        """The key's name, hashed, as four numbers of 64 bits."""
        return struct.unpack("<4Q", hashlib.sha256(self.key_id.encode()).digest())

    def chain(self, master: bytes, first: int, last: int) -> Iterator[tuple[int, bytes]]:
        """(d, C_d) from the last day down to the anchor, whose number is first - 1."""
        fleet = stream(master, "fleet", (self.number, *self.id_words), SECRET_BYTES)
        link = stream(fleet, "chain", (self.number, first, last), SECRET_BYTES)
        yield last, link
        for day in range(last, first - 1, -1):
            link = self.earlier(link, day)
            yield day - 1, link

    def earlier(self, link: bytes, day: int) -> bytes:
        """C_d-1 from C_d."""
        return stream(link, "step", (self.number, day - 1), SECRET_BYTES)

    def day_secret(self, link: bytes, day: int) -> bytes:
        """D_d from C_d."""
        return stream(link, "day", (self.number, day), SECRET_BYTES)

    def channel_secret(self, day_secret: bytes, day: int, channel: int) -> bytes:
        """K_d,c from D_d."""
        return stream(day_secret, "channel", (self.number, day, channel), SECRET_BYTES)

    def tags_secret(self, day_secret: bytes, day: int) -> bytes:
        """T_d from D_d."""
        return stream(day_secret, "tags", (self.number, day), SECRET_BYTES)


def tree_of(key_id: str, scheme: Scheme) -> Tree:
    """The tree of a key's name and scheme."""
    return Tree(key_id, scheme.fingerprint)
