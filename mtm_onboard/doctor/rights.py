"""What a robot needs of its key file beyond reading it: a kind and days that are its own, and a ledger of slots."""

import math
from datetime import UTC, datetime
from pathlib import Path

from mtm_onboard.doctor.finding import Finding
from mtm_onboard.journal.ledger import Ledger
from mtm_onboard.protocol import Key, MtmError

_SOON_S = 7 * 86_400.0


def check_grant(key: Key, now: datetime) -> Finding:
    """Check that the file is a robot's, of format 2, and that its days have come and last for another week."""
    grant = key.holding.grant
    if grant is None or grant.kind == "master":
        return Finding("grant", "warn", str(key.warning))
    if grant.kind != "robot":
        return Finding(
            "grant", "warn",
            f"{key.id} is no robot's file ({grant.kind}) and plays every channel; have one issued for this robot alone",
        )  # fmt: skip
    days = f"from {grant.first_day} to {grant.last_day}"
    try:
        grant.check_unexpired(now.timestamp())
    except MtmError as error:
        return Finding("grant", "fail", str(error))
    if not grant.first_day <= now.date() <= grant.last_day:
        return Finding("grant", "fail", f"the key file is for days {days}, and today is none; have a new one issued")
    left_s = _left_s(key, now)
    figures = {"days_left": round(left_s / 86_400.0, 1)}
    if left_s < _SOON_S:
        return Finding(
            "grant", "warn", f"the key file is for days {days} and soon over; have a new one issued", figures
        )
    return Finding("grant", "pass", f"a robot's file for {', '.join(grant.channels)}, {days}", figures)


def _left_s(key: Key, now: datetime) -> float:
    grant = key.holding.grant
    if grant is None:
        return math.inf
    end = datetime(grant.last_day.year, grant.last_day.month, grant.last_day.day, tzinfo=UTC).timestamp() + 86_400.0
    if grant.not_after is not None:
        end = min(end, grant.not_after.timestamp())
    return end - now.timestamp()


def check_state(path: Path | None, key: Key) -> Finding:
    """Check that what keeps slots from being played twice can be kept, and that what is kept is whole."""
    rolling = key.scheme.schedule == "rolling"
    if path is None:
        if rolling:
            return Finding(
                "state", "fail",
                "nothing keeps which slots were played, and the rolling schedule needs that; name a file in [state], "
                "or keep a journal",
            )  # fmt: skip
        return Finding("state", "pass", "none is kept, and the fixed schedule needs none")
    own = (path, path.with_name(f"{path.name}.lock"))
    there = [each.exists() for each in own]
    try:
        with Ledger(path, key.id, key.scheme.fingerprint) as ledger:
            played = ledger.last_slot
            # What a look made it takes away again, while no run can have it open.
            for each, was in zip(own, there, strict=True):
                if not was:
                    each.unlink()
    except MtmError as error:
        return Finding("state", "fail", str(error))
    if not rolling or played < 0:
        return Finding("state", "pass", f"{path} can be kept, and says of no slot that it was played")
    return Finding("state", "pass", f"{path} is whole; slots up to {played} are not played again")
