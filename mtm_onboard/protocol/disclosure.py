"""Public verification by delayed disclosure: the anchor of a fleet's days, and a day's key once the day is over.

The days' links are a one-way chain, see `key_tree`, whose end, the anchor, is public from the beginning. When a day is
over and a margin has passed, its link is given out. Whoever has the anchor checks it by walking the chain, reads what
robots said on that day, and knows that nobody could have made their motions then who had no file of that day. From the
disclosure on everybody can make them: a film proves something only when it existed before.
"""

import hmac
import re
from dataclasses import dataclass
from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path
from typing import Any

from mtm_onboard.protocol.atomicfile import write_new
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.holding import DayHolding, epoch_of_day
from mtm_onboard.protocol.holding_file import check_days, holding_from_table
from mtm_onboard.protocol.input_file import BrokenTextError, parsed_toml, read_text
from mtm_onboard.protocol.key import Key, key_text
from mtm_onboard.protocol.key_tree import Tree, tree_of
from mtm_onboard.protocol.keystream import SECRET_BYTES
from mtm_onboard.protocol.master import MasterHolding
from mtm_onboard.protocol.scheme import Scheme, scheme_from_table
from mtm_onboard.protocol.schemefile import scheme_text

MARGIN = timedelta(hours=1)
"""From the end of a day to its disclosure: longer than clocks are apart and than a message that began on the day."""

# How far back a key is looked for that a later day's robots carry.
_DAYS_BACK = 366
_FIELDS = {"format", "kind", "id", "first_day", "last_day", "margin_s", "anchor", "scheme"}


@dataclass(frozen=True)
class Anchor:
    """What verifies the days from `first_day` to `last_day` of a key; public. `value` is the chain's end."""

    id: str
    scheme: Scheme
    first_day: date
    last_day: date
    margin: timedelta
    value: bytes

    def disclosed_from(self, day: date) -> datetime:
        """The instant before which the day's key was not public."""
        return _end_of(day) + self.margin

    def verified(self, disclosed: Key) -> Key:
        """The disclosed key itself when it is that of its day in this chain; raises MtmError when it is not."""
        held = disclosed.secret
        if not isinstance(held, DayHolding) or held.link is None:
            raise MtmError("the disclosed key is none; name a file that mtm-onboard disclose wrote")
        if (disclosed.id, disclosed.scheme) != (self.id, self.scheme):
            raise MtmError(f"the disclosed key is of {disclosed.id} and the anchor of {self.id}, or of another scheme; "
                           "name two that belong together")  # fmt: skip
        day = held.grant.first_day
        if not self.first_day <= day <= self.last_day:
            raise MtmError(f"the anchor is for {self.first_day} to {self.last_day}, and the disclosed key for {day}; "
                           "name the anchor of that day")  # fmt: skip
        if not self.holds(held.link, day):
            raise MtmError(f"the disclosed key is not the one of {day} in the anchor's chain: it is of another day, "
                           "altered, or made up; get it again from whoever runs the fleet")  # fmt: skip
        return disclosed

    def holds(self, link: bytes, day: date) -> bool:
        """Whether a link is that of the day: walking down from it reaches the anchor in as many steps as days."""
        first, epoch = (epoch_of_day(each, self.scheme) for each in (self.first_day, day))
        return reaches(tree_of(self.id, self.scheme), link, range(epoch, first - 1, -1), self.value)

    def day_of(self, link: bytes, before: date) -> date | None:
        """Which of the 366 days before that one has this link; None when none has."""
        # A step of the chain names its day, so each day has a walk of its own; the latest first, as robots carry it.
        days = (before - timedelta(number) for number in range(1, _DAYS_BACK + 1))
        own = (day for day in days if self.first_day <= day <= self.last_day)
        return next((day for day in own if self.holds(link, day)), None)


def reaches(tree: Tree, link: bytes, epochs: range, anchor: bytes) -> bool:
    """Whether one step down the chain for each of `epochs`, the link's own first, ends at the anchor."""
    for epoch in epochs:
        link = tree.earlier(link, epoch)
    return hmac.compare_digest(link, anchor)


def anchor_of(key: Key) -> Anchor:
    """The anchor of a master; raises MtmError when the key is none."""
    held = key.secret
    if not isinstance(held, MasterHolding):
        raise MtmError("an anchor is made from a master; name the file that mtm-onboard keygen made")
    return Anchor(key.id, key.scheme, held.grant.first_day, held.grant.last_day, MARGIN, held.anchor)


def disclosed_key(key: Key, day: date, now: datetime) -> Key:
    """The key of a day that is over; raises MtmError when it is not yet, and for what is no master."""
    held = key.secret
    if not isinstance(held, MasterHolding):
        raise MtmError("a day is disclosed from the master; name the file that mtm-onboard keygen made")
    earliest = _end_of(day) + MARGIN
    if now < earliest:
        raise MtmError(f"{day} is not to be disclosed before {earliest:%Y-%m-%d %H:%M} UTC: until then everybody could "
                       "make its motions; wait")  # fmt: skip
    return Key(key.id, held.disclosed(day), key.scheme)


def save_anchor(anchor: Anchor, path: Path) -> None:
    """Write the anchor's file, which must not exist; anybody may read it."""
    text = (
        f'format = 2\nkind = "anchor"\nid = "{anchor.id}"\nfirst_day = {anchor.first_day}\n'
        f"last_day = {anchor.last_day}\nmargin_s = {int(anchor.margin.total_seconds())}\n"
        f'anchor = "{anchor.value.hex()}"\n\n{scheme_text(anchor.scheme)}'
    )
    write_new(path, text, mode=0o644)


def save_disclosed(key: Key, path: Path) -> None:
    """Write a disclosed day's file, which must not exist; anybody may read it."""
    write_new(path, key_text(key), mode=0o644)


def load_anchor(path: Path) -> Anchor:
    """Read an anchor's file; raises MtmError with one sentence that says what to change."""
    table = _public_table(path, "the anchor")
    try:
        return _anchor(table)
    except MtmError as error:
        raise MtmError(f"{path}: {error}") from error


def load_disclosed(path: Path, anchor: Anchor) -> Key:
    """Read a disclosed day's file and verify it; raises MtmError when it is none, and when the anchor denies it."""
    table = _public_table(path, "the disclosed key")
    try:
        if table.get("format") != 2 or table.get("kind") != "disclosed" or not isinstance(table.get("scheme"), dict):
            raise MtmError("it is no disclosed key; name a file that mtm-onboard disclose wrote")
        scheme, name = scheme_from_table(table["scheme"]), table.get("id")
        if not isinstance(name, str):
            raise MtmError("it has no name; name a file that mtm-onboard disclose wrote")
        return anchor.verified(Key(name, holding_from_table(table, scheme), scheme))
    except MtmError as error:
        raise MtmError(f"{path}: {error}") from error


def _anchor(table: dict[str, Any]) -> Anchor:
    if table.get("format") != 2 or table.get("kind") != "anchor" or table.keys() != _FIELDS:
        raise MtmError("it is no anchor; name a file that mtm-onboard anchor wrote")
    check_days(table["first_day"], table["last_day"])
    name, margin_s, value = table["id"], table["margin_s"], table["anchor"]
    if not isinstance(table["scheme"], dict) or not isinstance(name, str):
        raise MtmError("its name or scheme is none; get it again from whoever runs the fleet")
    if type(margin_s) is not int or not 0 < margin_s <= 366 * 86_400:
        raise MtmError("margin_s must be a number of seconds above zero; get it again from whoever runs the fleet")
    if not isinstance(value, str) or not re.fullmatch(rf"[0-9a-f]{{{2 * SECRET_BYTES}}}", value):
        raise MtmError("the anchor is not 64 hexadecimal digits; get it again from whoever runs the fleet")
    scheme = scheme_from_table(table["scheme"])
    return Anchor(
        name, scheme, table["first_day"], table["last_day"], timedelta(seconds=margin_s), bytes.fromhex(value)
    )


def _public_table(path: Path, what: str) -> dict[str, Any]:
    try:
        return parsed_toml(read_text(path, what))
    except BrokenTextError as error:
        raise MtmError(f"{path} is not valid TOML ({error}); name {what}") from error


def _end_of(day: date) -> datetime:
    return datetime.combine(day, time(), UTC) + timedelta(days=1)
