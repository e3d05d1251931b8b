"""What a key file holds: the one secret of format 1, or a part of the key tree of format 2."""

import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from functools import cached_property
from typing import Literal, Protocol

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key_tree import Tree
from mtm_onboard.protocol.keystream import stream
from mtm_onboard.protocol.scheme import Scheme
from mtm_onboard.protocol.slots import EPOCH_S, last_slot_of_epoch, slot_at
from mtm_onboard.protocol.tag_key import TagKey

Kind = Literal["master", "robot", "auditor", "disclosed", "public"]
_UNIX_DAY = date(1970, 1, 1)


class Holding(Protocol):
    """The secrets that a key file gives, for the epochs and channels that it is for."""

    @property
    def grant(self) -> "Grant | None":
        """What the file is for; None for format 1, which is for everything."""
        ...

    def channel_secret(self, epoch: int, channel: int) -> bytes:
        """The secret of the channel's waveforms, by its place in the scheme; raises MtmError when it is not held."""
        ...

    def tag_key(self, epoch: int) -> TagKey:
        """What frames of that epoch are tagged with; raises MtmError when it is not held."""
        ...

    def decoy_seed(self) -> bytes:
        """A secret from which keys that nobody holds are drawn."""
        ...


@dataclass(frozen=True)
class OneSecret:
    """Format 1: one secret for every channel and every day."""

    secret: bytes = field(repr=False)
    grant: None = None

    def channel_secret(self, epoch: int, channel: int) -> bytes:
        """The secret."""
        return self.secret

    def tag_key(self, epoch: int) -> TagKey:
        """The secret, for frames of version 1."""
        return TagKey(self.secret)

    def decoy_seed(self) -> bytes:
        """The secret."""
        return self.secret


@dataclass(frozen=True, kw_only=True)
class Grant:
    """What a file of format 2 is for: a kind of holder, its channels' names, and days from `first_day` to `last_day`.

    `serial` names the file where it is revoked, and after `not_after` it is not used, None for no such instant.
    """

    kind: Kind
    channels: tuple[str, ...]
    first_day: date
    last_day: date
    serial: str
    not_after: datetime | None = None

    def epochs(self, scheme: Scheme) -> range:
        """The scheme's epochs of its days."""
        return range(epoch_of_day(self.first_day, scheme), epoch_of_day(self.last_day, scheme) + 1)

    def first_slot(self, scheme: Scheme) -> int:
        """The first message slot that it is for."""
        return last_slot_of_epoch(self.epochs(scheme)[0] - 1, scheme) + 1

    def last_slot(self, scheme: Scheme) -> int:
        """The last message slot that it is for."""
        last = last_slot_of_epoch(self.epochs(scheme)[-1], scheme)
        return last if self.not_after is None else min(last, slot_at(self.not_after.timestamp(), scheme))

    def check_unexpired(self, unix_s: float) -> None:
        """Raise MtmError when `not_after` has passed at that time."""
        if self.not_after is not None and unix_s > self.not_after.timestamp():
            raise MtmError(
                f"this key file expired on {self.not_after.astimezone(UTC):%Y-%m-%d at %H:%M:%S} UTC; have a new one "
                "issued"
            )


@dataclass(frozen=True)
class DayHolding:
    """The days' secrets, and so all channels of each: an auditor's, a master's, or a disclosed day's.

    `link` is the disclosed day's of the chain, None for the others.
    """

    grant: Grant
    tree: Tree
    scheme: Scheme
    day_secrets: Mapping[int, bytes] = field(repr=False, hash=False)
    link: bytes | None = field(default=None, repr=False)

    @cached_property
    def _derived(self) -> dict[tuple[int, int], bytes]:
        return {}

    def channel_secret(self, epoch: int, channel: int) -> bytes:
        """K of that day and channel."""
        known = self._derived.get((epoch, channel))
        if known is None:
            known = self.tree.channel_secret(_of_day(self.day_secrets, epoch, self), epoch, channel)
            self._derived[epoch, channel] = known
        return known

    def tag_key(self, epoch: int) -> TagKey:
        """T of that day, for frames of version 2."""
        return _tag_key(self.tree.tags_secret(_of_day(self.day_secrets, epoch, self), epoch), self.tree, self.scheme)

    def decoy_seed(self) -> bytes:
        """From the first day that is held."""
        first = min(self.day_secrets)
        return stream(self.day_secrets[first], "decoys", (self.tree.number, first), 32)


@dataclass(frozen=True)
class RobotHolding:
    """A robot's own channels' secrets by (epoch, place in the scheme), and the tags' by epoch."""

    grant: Grant
    tree: Tree
    scheme: Scheme
    channel_secrets: Mapping[tuple[int, int], bytes] = field(repr=False, hash=False)
    tags_secrets: Mapping[int, bytes] = field(repr=False, hash=False)

    def channel_secret(self, epoch: int, channel: int) -> bytes:
        """K of that day and channel."""
        if self.scheme.channels[channel].name not in self.grant.channels:
            raise MtmError(
                f"this key file is a robot's, for {', '.join(self.grant.channels)} and not for "
                f"{self.scheme.channels[channel].name}; name that channel's robot, or take an auditor's file"
            )
        _of_day(self.tags_secrets, epoch, self)
        return self.channel_secrets[epoch, channel]

    def tag_key(self, epoch: int) -> TagKey:
        """T of that day, for frames of version 2."""
        return _tag_key(_of_day(self.tags_secrets, epoch, self), self.tree, self.scheme)

    def decoy_seed(self) -> bytes:
        """From the first day that is held."""
        first = min(self.tags_secrets)
        return stream(self.tags_secrets[first], "decoys", (self.tree.number, first), 32)


Secret = bytes | Holding
"""The secret of format 1 itself, or what a file holds."""


def holding_of(secret: Secret) -> Holding:
    """A bare secret is that of format 1."""
    return OneSecret(secret) if isinstance(secret, bytes) else secret


def epoch_of_day(day: date, scheme: Scheme) -> int:
    """The scheme's epoch of a day in UTC."""
    return scheme.epoch + (day - _UNIX_DAY).days


def day_of_epoch(epoch: int, scheme: Scheme) -> date:
    """The day in UTC of a scheme's epoch."""
    return datetime.fromtimestamp((epoch - scheme.epoch) * EPOCH_S, UTC).date()


def new_serial() -> str:
    """Sixteen hexadecimal digits by which a file is named."""
    return secrets.token_hex(8)


def _of_day(held: Mapping[int, bytes], epoch: int, holding: DayHolding | RobotHolding) -> bytes:
    try:
        return held[epoch]
    except KeyError:
        grant = holding.grant
        days = f"{grant.first_day} to {grant.last_day}" if grant.first_day < grant.last_day else f"{grant.first_day}"
        raise MtmError(
            f"this key file is for {days} and not for {day_of_epoch(epoch, holding.scheme)}; have one issued for that "
            "day, or correct the time"
        ) from None


def _tag_key(secret: bytes, tree: Tree, scheme: Scheme) -> TagKey:
    count = len(scheme.channels)
    whole = (1 << count) - 1
    channels = tuple(whole >> shift & (1 << 64) - 1 for shift in range(0, count, 64))
    return TagKey(secret, (tree.number, *tree.id_words, *channels))
