"""The public channel: motion that everybody with a fleet's anchor can read, and that carries a disclosed day's key.

Its waveforms come from the anchor, which is public, so anybody can read them, and play them as well. That does no harm:
what is said there is a link of the anchor's own chain, which the anchor confirms and which nobody can make up. So who
has the anchor and a film of a later day needs nothing else to verify the film of the disclosed one, no network and no
other key.

    channel    P_d,c = stream(anchor, "public", fingerprint, d, c)

with the fingerprint of the public channel's own scheme, see `public_scheme`, and d the epoch in which it is played.
"""

from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, timedelta

from mtm_onboard.protocol.disclosure import Anchor
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.framing.framing import Framing, layout_of
from mtm_onboard.protocol.holding import DayHolding, Grant, epoch_of_day, new_serial
from mtm_onboard.protocol.key import Key
from mtm_onboard.protocol.key_tree import tree_of
from mtm_onboard.protocol.keystream import SECRET_BYTES, stream
from mtm_onboard.protocol.scheme import Scheme
from mtm_onboard.protocol.tag_key import TagKey

# Everything that says that the key was read right is in the anchor; this only lets the decoder choose among candidates.
_FRAMING = Framing("bytes", 8 * SECRET_BYTES, check="crc", check_bits=16, code="reed-solomon", interleave=True)
# So that a fleet of four is read when one robot is out of sight.
_LEAST_PARITY = 0.25
_MOST_MESSAGES = 1024
# How long after its last day a chain's keys may still be carried.
_AFTERWARDS = timedelta(366)


@dataclass(frozen=True)
class PublicHolding:
    """The secrets of the public channel, which are none: whoever has the anchor has them."""

    grant: Grant
    scheme: Scheme
    anchor: bytes

    def channel_secret(self, epoch: int, channel: int) -> bytes:
        """P of that day and channel."""
        return stream(self.anchor, "public", (int(self.scheme.fingerprint, 16), epoch, channel), SECRET_BYTES)

    def tag_key(self, epoch: int) -> TagKey:
        """The anchor; the channel's frames have no tag."""
        return TagKey(self.anchor)

    def decoy_seed(self) -> bytes:
        """From the anchor."""
        return stream(self.anchor, "decoys", (int(self.scheme.fingerprint, 16),), SECRET_BYTES)


def public_scheme(scheme: Scheme) -> Scheme:
    """The scheme of the public channel: the fleet's own, its messages made longer until one holds a day's key.

    Windows, band, noise and channels are the fleet's, so that the robots carry both alike. A message takes the time of
    the fewest messages of the fleet whose symbols hold 32 bytes and a quarter parity. Raises MtmError when none do.
    """
    alphabet_size = 1 << scheme.alphabet_size.bit_length() - 1
    for count in range(1, _MOST_MESSAGES + 1):
        try:
            layout = layout_of(_FRAMING, alphabet_size, count * scheme.message_symbols)
            if layout.parity < _LEAST_PARITY * layout.code_symbols:
                continue
            return replace(
                scheme,
                name=f"{scheme.name}-public",
                alphabet_size=alphabet_size,
                message_ticks=count * scheme.message_ticks,
                channels=tuple(replace(channel, symbols=count * channel.symbols) for channel in scheme.channels),
                framing=_FRAMING,
            )
        except MtmError:
            # Too short yet, or too long for the scheme.
            continue
    raise MtmError("a day's key does not fit into 1024 messages of this scheme; give the key out as a file")


def public_key(anchor: Anchor) -> Key:
    """The key of the public channel, which reads and plays it on all days on which there is one to carry."""
    scheme = public_scheme(anchor.scheme)
    grant = Grant(
        kind="public",
        channels=tuple(channel.name for channel in scheme.channels),
        first_day=anchor.first_day,
        last_day=min(anchor.last_day, date.max - _AFTERWARDS) + _AFTERWARDS,
        serial="0" * 16,
    )
    return Key(anchor.id, PublicHolding(grant, scheme, anchor.value), scheme)


def carried_key(anchor: Anchor, link: bytes, played_on: date) -> Key:
    """The disclosed day's key that a message of the public channel is; raises MtmError when the anchor denies it."""
    day = anchor.day_of(link, played_on)
    if day is None:
        raise MtmError(
            "what is played on the public channel is no key of the anchor's chain: everybody can play there, and this "
            "was made up or misread; film the robots for longer, or get the day's key from whoever runs the fleet"
        )
    scheme, tree = anchor.scheme, tree_of(anchor.id, anchor.scheme)
    epoch = epoch_of_day(day, scheme)
    names = tuple(channel.name for channel in scheme.channels)
    grant = Grant(kind="disclosed", channels=names, first_day=day, last_day=day, serial=new_serial())
    return Key(anchor.id, DayHolding(grant, tree, scheme, {epoch: tree.day_secret(link, epoch)}, link), scheme)


def link_to_carry(anchor: Anchor, disclosed: Key, now: datetime) -> bytes:
    """What the public channel carries of a verified disclosed key; raises MtmError before it may be public."""
    held = anchor.verified(disclosed).secret
    assert isinstance(held, DayHolding)
    assert held.link is not None
    day = held.grant.first_day
    if now < anchor.disclosed_from(day):
        raise MtmError(
            f"the key of {day} is not to be played before {anchor.disclosed_from(day).astimezone(UTC):%Y-%m-%d %H:%M} "
            "UTC: until then everybody who reads it could make that day's motions; wait, or play an earlier day's"
        )
    return held.link
