"""Key files of format 2: the part of a key tree that a master, a robot, an auditor or a disclosed day has, in TOML."""

import re
from collections.abc import Sequence
from datetime import date, datetime, timedelta
from typing import Any

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.holding import DayHolding, Grant, Holding, RobotHolding
from mtm_onboard.protocol.key_tree import Tree, tree_of
from mtm_onboard.protocol.keystream import SECRET_BYTES
from mtm_onboard.protocol.master import MasterHolding
from mtm_onboard.protocol.scheme import Scheme

_COMMON = {"format", "kind", "id", "serial", "first_day", "last_day", "scheme"}
_OWN = {
    "master": {"secret"},
    "auditor": {"day_secrets"},
    "disclosed": {"link"},
    "robot": {"channels", "channel_secrets", "tags_secrets"},
}
_OPTIONAL = {"not_after"}
# A key's days, a hundred years of them; a file of more would take seconds to walk.
MOST_DAYS = 36_525


def holding_text(holding: Holding) -> str:
    """The fields of a key file that come before its scheme, `id` left out; raises TypeError for format 1."""
    grant = holding.grant
    if grant is None:
        raise TypeError("what has no grant is of format 1")
    lines = [f'kind = "{grant.kind}"', f'serial = "{grant.serial}"']
    lines += [f"first_day = {grant.first_day}", f"last_day = {grant.last_day}"]
    if grant.not_after is not None:
        lines.append(f"not_after = {grant.not_after.isoformat()}")
    if isinstance(holding, MasterHolding):
        lines.append(f'secret = "{holding.master.hex()}"')
    elif isinstance(holding, RobotHolding):
        names = ", ".join(f'"{name}"' for name in grant.channels)
        lines.append(f"channels = [{names}]")
        epochs = sorted(holding.tags_secrets)
        numbers = [holding.scheme.channels.index(holding.scheme.channel(name)) for name in grant.channels]
        rows = [_list([holding.channel_secrets[epoch, number] for epoch in epochs]) for number in numbers]
        lines.append("channel_secrets = [\n" + ",\n".join(rows) + ",\n]")
        lines.append(f"tags_secrets = {_list([holding.tags_secrets[epoch] for epoch in epochs])}")
    elif isinstance(holding, DayHolding):
        if holding.link is not None:
            lines.append(f'link = "{holding.link.hex()}"')
        else:
            lines.append(f"day_secrets = {_list([secret for _, secret in sorted(holding.day_secrets.items())])}")
    return "\n".join(lines)


def holding_from_table(table: dict[str, Any], scheme: Scheme) -> Holding:
    """What a parsed key file of format 2 holds; raises MtmError that says what is wrong, and quotes no secret."""
    kind: Any = table.get("kind")
    if not isinstance(kind, str) or kind not in _OWN:
        raise MtmError(f"the kind is {kind!r}; name a file that mtm-onboard keygen or issue wrote")
    unknown = sorted(table.keys() - _COMMON - _OWN[kind] - _OPTIONAL)
    if unknown:
        raise MtmError(f"it has an unknown field {unknown[0]!r}; remove it or correct its spelling")
    missing = sorted((_COMMON | _OWN[kind]) - table.keys())
    if missing:
        raise MtmError(f"it lacks {', '.join(missing)}; it may be cut off, so have it issued anew")
    if scheme.schedule != "rolling":
        raise MtmError('keys of format 2 have a day\'s key for each day and need schedule = "rolling"; issue it anew')
    grant = _grant(table, scheme)
    epochs, tree = grant.epochs(scheme), tree_of(table["id"], scheme)
    if kind == "master":
        return MasterHolding(grant, tree, scheme, _secret(table["secret"]))
    if kind == "robot":
        return _robot(table, grant, tree, scheme)
    if kind == "disclosed":
        link = _secret(table["link"])
        return DayHolding(grant, tree, scheme, {epochs[0]: tree.day_secret(link, epochs[0])}, link)
    return DayHolding(
        grant, tree, scheme, dict(zip(epochs, _secrets(table["day_secrets"], len(epochs)), strict=True)), None
    )


def _robot(table: dict[str, Any], grant: Grant, tree: Tree, scheme: Scheme) -> RobotHolding:
    epochs, rows = grant.epochs(scheme), table["channel_secrets"]
    numbers = [scheme.channels.index(scheme.channel(name)) for name in grant.channels]
    if not isinstance(rows, list) or len(rows) != len(numbers):
        raise MtmError("channel_secrets must have one list for each channel; have it issued anew")
    channel_secrets = {
        (epoch, number): secret
        for number, row in zip(numbers, rows, strict=True)
        for epoch, secret in zip(epochs, _secrets(row, len(epochs)), strict=True)
    }
    tags = dict(zip(epochs, _secrets(table["tags_secrets"], len(epochs)), strict=True))
    return RobotHolding(grant, tree, scheme, channel_secrets, tags)


def _grant(table: dict[str, Any], scheme: Scheme) -> Grant:
    kind, first, last = table["kind"], table["first_day"], table["last_day"]
    check_days(first, last)
    if kind == "disclosed" and first != last:
        raise MtmError("a disclosed key is one day's; have that day's disclosed")
    serial, not_after = table["serial"], table.get("not_after")
    if not isinstance(serial, str) or not re.fullmatch(r"[0-9a-f]{16}", serial):
        raise MtmError("the serial must be sixteen hexadecimal digits; have it issued anew")
    if not_after is not None and (not isinstance(not_after, datetime) or not_after.tzinfo is None):
        raise MtmError("not_after must be a date and time with its offset, such as 2026-12-31T00:00:00Z")
    channels = table.get("channels", [channel.name for channel in scheme.channels])
    if not isinstance(channels, list) or not channels or not all(isinstance(name, str) for name in channels):
        raise MtmError("channels must be a list of names; have it issued anew")
    if len(set(channels)) != len(channels):
        raise MtmError("channels names one twice; have it issued anew")
    for name in channels:
        scheme.channel(name)
    return Grant(
        kind=kind, channels=tuple(channels), first_day=first, last_day=last, serial=serial, not_after=not_after
    )


def check_days(first: Any, last: Any) -> None:
    """Raise MtmError unless these are two days, in order and not too far apart."""
    for day in (first, last):
        if not isinstance(day, date) or isinstance(day, datetime):
            raise MtmError(f"{day!r} is no day; give one such as 2026-01-31")
        if day.year < 1970:
            raise MtmError(f"{day} is before 1970, which has no waveforms; give a later day")
    if last < first:
        raise MtmError(f"the last day, {last}, is before the first, {first}; give them in order")
    if last - first >= timedelta(MOST_DAYS):
        raise MtmError(f"{first} to {last} are more than {MOST_DAYS} days; give fewer")


def _list(secrets: Sequence[bytes]) -> str:
    return "[\n" + "".join(f'    "{secret.hex()}",\n' for secret in secrets) + "]"


def _secrets(values: Any, count: int) -> list[bytes]:
    if not isinstance(values, list) or len(values) != count:
        raise MtmError("there must be one secret for each day; it may be cut off, so have it issued anew")
    return [_secret(value) for value in values]


def _secret(text: Any) -> bytes:
    digits = 2 * SECRET_BYTES
    if not isinstance(text, str) or not re.fullmatch(rf"[0-9a-fA-F]{{{digits}}}", text):
        raise MtmError(f"a secret must be {digits} hexadecimal digits; have it issued anew")
    return bytes.fromhex(text)
