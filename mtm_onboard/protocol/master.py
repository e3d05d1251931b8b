"""The master of a key tree, and what is cut from it: files for robots, auditors, and days that are disclosed."""

import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date, datetime, timedelta
from functools import cached_property

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.holding import DayHolding, Grant, Kind, RobotHolding, epoch_of_day, new_serial
from mtm_onboard.protocol.key_tree import Tree, tree_of
from mtm_onboard.protocol.keystream import SECRET_BYTES, stream
from mtm_onboard.protocol.scheme import Scheme
from mtm_onboard.protocol.tag_key import TagKey

# Ten years, leap days included.
USUAL_DAYS = 3653


@dataclass(frozen=True)
class MasterHolding:
    """The master secret, from which all else comes; `grant` says which days the chain spans."""

    grant: Grant
    tree: Tree
    scheme: Scheme
    master: bytes = field(repr=False)

    @cached_property
    def links(self) -> Mapping[int, bytes]:
        """C of each day by epoch, and of the epoch before the first the anchor."""
        epochs = self.grant.epochs(self.scheme)
        return dict(self.tree.chain(self.master, epochs[0], epochs[-1]))

    @property
    def anchor(self) -> bytes:
        """The chain's end, which may be published."""
        return self.links[self.grant.epochs(self.scheme)[0] - 1]

    @cached_property
    def days(self) -> DayHolding:
        """The secrets of all days."""
        epochs = self.grant.epochs(self.scheme)
        secrets_ = {epoch: self.tree.day_secret(self.links[epoch], epoch) for epoch in epochs}
        return DayHolding(self.grant, self.tree, self.scheme, secrets_, None)

    def channel_secret(self, epoch: int, channel: int) -> bytes:
        """K of any day and channel."""
        return self.days.channel_secret(epoch, channel)

    def tag_key(self, epoch: int) -> TagKey:
        """T of any day."""
        return self.days.tag_key(epoch)

    def decoy_seed(self) -> bytes:
        """From the master."""
        return stream(self.master, "decoys", (self.tree.number,), SECRET_BYTES)

    def for_auditor(self, first: date, last: date, not_after: datetime | None = None) -> DayHolding:
        """All channels of some days; raises MtmError for days that the master has not."""
        grant = self._granted("auditor", self.grant.channels, first, last, not_after)
        day_secrets = {epoch: self.days.day_secrets[epoch] for epoch in grant.epochs(self.scheme)}
        return DayHolding(grant, self.tree, self.scheme, day_secrets, None)

    def for_robot(
        self, channels: Sequence[str], first: date, last: date, not_after: datetime | None = None
    ) -> RobotHolding:
        """Some channels of some days; raises MtmError for days or channels that there are not."""
        names = tuple(dict.fromkeys(channels))
        numbers = [self.scheme.channels.index(self.scheme.channel(name)) for name in names]
        grant = self._granted("robot", names, first, last, not_after)
        epochs = grant.epochs(self.scheme)
        own = {(epoch, number): self.channel_secret(epoch, number) for number in numbers for epoch in epochs}
        tags = {epoch: self.tag_key(epoch).secret for epoch in epochs}
        return RobotHolding(grant, self.tree, self.scheme, own, tags)

    def disclosed(self, day: date) -> DayHolding:
        """One day's link of the chain, which shows that day's secrets to everybody, and those of the days before."""
        grant = self._granted("disclosed", self.grant.channels, day, day, None)
        epoch = epoch_of_day(day, self.scheme)
        link = self.links[epoch]
        return DayHolding(grant, self.tree, self.scheme, {epoch: self.tree.day_secret(link, epoch)}, link)

    def _granted(
        self, kind: Kind, channels: tuple[str, ...], first: date, last: date, not_after: datetime | None
    ) -> Grant:
        own = self.grant
        if last < first:
            raise MtmError(f"the last day, {last}, is before the first, {first}; give them in order")
        if not own.first_day <= first <= last <= own.last_day:
            raise MtmError(f"this master is for {own.first_day} to {own.last_day}; give days among these")
        return replace(
            own, kind=kind, channels=channels, first_day=first, last_day=last, serial=new_serial(), not_after=not_after
        )


def new_master(key_id: str, scheme: Scheme, first: date, days: int = USUAL_DAYS) -> MasterHolding:
    """A master with a fresh secret from the operating system's generator, for so many days from the first on."""
    grant = Grant(
        kind="master",
        channels=tuple(channel.name for channel in scheme.channels),
        first_day=first,
        last_day=first + timedelta(days - 1),
        serial=new_serial(),
    )
    return MasterHolding(grant, tree_of(key_id, scheme), scheme, secrets.token_bytes(SECRET_BYTES))
