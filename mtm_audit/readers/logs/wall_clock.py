"""When a capture began, as programs write it: dates of a country's kind, without a time zone."""

import re
from datetime import datetime

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.readers.logs.body import Warn

_DATE = re.compile(
    r"(?P<date>\d{4}-\d{2}-\d{2})[, T]+(?P<hour>\d{1,2})[:.](?P<minute>\d{2})[:.](?P<second>\d{2})"
    r"(?:[.,](?P<part>\d{1,6}))?\s*(?P<rest>.*)"
)


def captured_at(text: str, where: str, warn: Warn) -> RecordedAt | None:
    """The instant that `text` names on the clock of this machine's zone, which `warn` is told; None for none."""
    found = _DATE.match(text.strip())
    half = "" if found is None else re.sub(r"[\s.]", "", found["rest"]).lower()
    if found is None or half not in ("", "am", "pm"):
        # Other languages have other words for the halves of a day, and a wrong one is half a day off.
        if text.strip():
            warn(f"{where}: capture began at {text.strip()[:60]!r}, which is not understood; give --at if it matters")
        return None
    hour = int(found["hour"])
    if half:
        hour = hour % 12 + (12 if half == "pm" else 0)
    micro = int((found["part"] or "0").ljust(6, "0"))
    try:
        day = datetime.strptime(found["date"], "%Y-%m-%d")
        moment = day.replace(hour=hour, minute=int(found["minute"]), second=int(found["second"]), microsecond=micro)
        unix_s = moment.timestamp()
    except (ValueError, OverflowError, OSError):
        return None
    warn(
        f"{where}: capture began at {moment.isoformat(sep=' ')}, of no zone, and is taken as this machine's time; give "
        "--at if that is another"
    )
    return RecordedAt(unix_s)
