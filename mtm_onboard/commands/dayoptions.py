"""The options that say days, and instants, shared by the commands that make key files."""

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from datetime import date, datetime


def add_days(parser: argparse.ArgumentParser, default_days: int) -> None:
    """Add --first-day (today) and --days."""
    parser.add_argument(
        "--first-day", type=_day, metavar="DAY", help="the first day, in UTC, such as 2026-01-31 (today)"
    )
    parser.add_argument("--days", type=int, default=default_days, metavar="N", help="how many days (%(default)s)")


def first_day(args: argparse.Namespace) -> "date":
    """The first day that was given, or today."""
    from datetime import UTC, datetime

    given: date | None = args.first_day
    return datetime.now(UTC).date() if given is None else given


def day(text: str) -> "date":
    """A day; raises ValueError for other text."""
    return _day(text)


def instant(text: str) -> "datetime":
    """A date and time, in UTC unless it says otherwise; raises ValueError for other text."""
    from datetime import UTC, datetime

    value = datetime.fromisoformat(text)
    return value if value.tzinfo is not None else value.replace(tzinfo=UTC)


def _day(text: str) -> "date":
    # No earlier than needed: help is shown without it.
    from datetime import date

    return date.fromisoformat(text)
