"""The time by which days' keys become public, from a clock that is kept right."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from datetime import datetime


def trusted_now(too_early: str, *, allow_unsynchronised: bool) -> "datetime":
    """The time now, in UTC; raises MtmError on a clock that nobody keeps right, unless that is allowed.

    `too_early` is what follows from a clock that runs ahead, for the sentence that says so.
    """
    from datetime import UTC, datetime

    from mtm_onboard.model.wall_clock import is_synchronised
    from mtm_onboard.protocol import MtmError

    if not allow_unsynchronised and is_synchronised() is not True:
        raise MtmError(
            f"the kernel does not report this computer's clock as synchronised, and {too_early}; wait for NTP, or give "
            "--allow-unsynchronised when you have looked at the clock"
        )
    return datetime.now(UTC)
