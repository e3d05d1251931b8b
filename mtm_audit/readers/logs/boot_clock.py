"""From a computer's time since boot to the time since the Unix epoch."""

from collections.abc import Sequence

import numpy as np

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Floats

# A receiver's time is right to a second once it has a fix; leap seconds may be those of its factory until then.
_GPS_ERROR_S = 1.0
_GPS_EPOCH_UNIX_S = 315_964_800.0
_WEEK_S = 604_800.0
# Since 2017.
_LEAP_S = 18.0
_EARLIEST_UNIX_S = 1e9


def unix_of_gps(weeks: Floats, milliseconds: Floats) -> Floats:
    """Seconds since the Unix epoch of GPS weeks and milliseconds within them."""
    return np.asarray(_GPS_EPOCH_UNIX_S + weeks * _WEEK_S + milliseconds / 1000.0 - _LEAP_S)


def booted_at(boot_s: Sequence[float] | Floats, unix_s: Sequence[float] | Floats) -> RecordedAt | None:
    """When a clock of `boot_s` stood at zero, from the Unix times known at those instants; None without any.

    The median counts: the first record after a fix may be late by as much as the whole log would be shifted.
    """
    boot, unix = np.asarray(boot_s, dtype=float), np.asarray(unix_s, dtype=float)
    known = np.isfinite(boot) & np.isfinite(unix) & (unix > _EARLIEST_UNIX_S)
    if not known.any():
        return None
    return RecordedAt(float(np.median(unix[known] - boot[known])), _GPS_ERROR_S)
