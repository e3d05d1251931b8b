"""ROS time as the loop's clock, for nodes under `use_sim_time`: it advances with each message on `/clock`."""

import time
from collections.abc import Callable

from mtm_onboard.protocol.errors import MtmError

_POLL_S = 0.001
# So many long steps in a row; a few may be long because this host was busy.
_TELLING_STEPS = 10
# Steps of one tick, give or take a float's last digits, are not long.
_LONG = 1.001
# Seconds since 1970 as floats stand a hair before a deadline they have reached; in ticks, less than the loop's own.
_HAIR = 5e-5


class RosTime:
    """The time that `now_s` says, in seconds; ticks follow it and not the number of messages on `/clock`.

    `sleep_until` looks every millisecond, returns early once `ended()`, and calls `warn` once when the clock's steps
    are longer than a tick of `period_s`, since ticks between two steps are missed. It raises MtmError when the clock
    goes back: the message's ticks would come again.
    """

    def __init__(
        self,
        now_s: Callable[[], float],
        period_s: float,
        ended: Callable[[], bool],
        warn: Callable[[str], None],
    ) -> None:
        self._now_s = now_s
        self._period_s = period_s
        self._ended = ended
        self._warn = warn
        self._newest_s = now_s()
        self._long_steps = 0
        self._warned = False

    def now(self) -> float:
        """Seconds of ROS time."""
        return self._now_s()

    def sleep_until(self, deadline_s: float) -> None:
        """Wait for ROS time to reach the deadline, or for the end."""
        deadline_s -= _HAIR * self._period_s
        while self._advanced() < deadline_s and not self._ended():
            time.sleep(_POLL_S)

    def _advanced(self) -> float:
        now_s = self._now_s()
        step_s = now_s - self._newest_s
        if step_s < 0.0:
            raise MtmError(
                f"/clock went back by {-step_s:.3f} s, so the message's ticks would come again; start the node anew, "
                "and see that one program alone publishes /clock"
            )
        if step_s > 0.0:
            self._newest_s = now_s
            self._long_steps = self._long_steps + 1 if step_s > _LONG * self._period_s else 0
            if self._long_steps == _TELLING_STEPS and not self._warned:
                self._warned = True
                self._warn(
                    f"/clock advances in steps of {step_s:.3f} s and a tick takes {self._period_s:.3f} s, so ticks are "
                    f"missed; publish it at {1.0 / self._period_s:g} Hz or more"
                )
        return now_s
