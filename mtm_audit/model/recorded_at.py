"""When a recording was made."""

import math
from dataclasses import dataclass

from mtm_onboard.protocol import MtmError

# Phones and robots set their clocks by the network, but nobody has compared them.
USUAL_ERROR_S = 30.0


@dataclass(frozen=True)
class RecordedAt:
    """The instant at which the recording's own clock stood at zero, in seconds since the Unix epoch, give or take.

    Raises MtmError when either is not a number or the error is negative.
    """

    unix_s: float
    error_s: float = USUAL_ERROR_S

    def __post_init__(self) -> None:
        if not (math.isfinite(self.unix_s) and math.isfinite(self.error_s) and self.error_s >= 0.0):
            raise MtmError(
                f"the recording was made at {self.unix_s} s, give or take {self.error_s} s, which is no time; give "
                "seconds since the Unix epoch and an error of zero or more"
            )
