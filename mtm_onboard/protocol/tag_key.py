"""What a frame's tag is made with, and what it binds."""

from dataclasses import dataclass, field

from mtm_onboard.protocol.keystream import stream

_WORD = 64


@dataclass(frozen=True)
class TagKey:
    """The secret of a frame's tag, and for frames of version 2 what else the tag binds, `bound`; None for version 1.

    Version 2 binds the scheme's fingerprint, the key's name (four words) and the set of channels (a bit for each, in
    words of 64) beside epoch, number and payload; and each slot's frame is masked by `slot_pad`.
    """

    secret: bytes = field(repr=False)
    bound: tuple[int, ...] | None = None

    def tag(self, epoch: int, number: int, words: tuple[int, ...], bits: int) -> int:
        """The first `bits` of stream(secret, "tag", epoch, number, words), and for version 2 of "tag 2"."""
        if self.bound is None:
            digest = stream(self.secret, "tag", (epoch, number, *words), _WORD // 8)
        else:
            digest = stream(self.secret, "tag 2", (*self.bound, epoch, number, *words), _WORD // 8)
        return int.from_bytes(digest, "big") >> (_WORD - bits)

    def slot_pad(self, epoch: int, slot: int, bits: int) -> int:
        """What is added (exclusive or) to a tag of version 2 in message slot `slot`, so that it holds in no other."""
        digest = stream(self.secret, "slot", (*(self.bound or ()), epoch, slot), _WORD // 8)
        return int.from_bytes(digest, "big") >> (_WORD - bits)


def tag_key_of(secret: bytes | TagKey) -> TagKey:
    """A bare secret is that of version 1."""
    return TagKey(secret) if isinstance(secret, bytes) else secret
