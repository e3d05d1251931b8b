"""A link that comes back: it wraps a maker of links and opens a new one when the one in use fails."""

import math
import threading
from collections.abc import Callable
from contextlib import suppress

from mtm_onboard.links.base import Link, LinkBusyError, TakenOverError
from mtm_onboard.model.clock import Clock
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol.errors import MtmError

_FIRST_PAUSE_S = 0.1
_LONGEST_PAUSE_S = 5.0
# Where the robot drives on until it is told to stop.
_LONGEST_PAUSE_WITHOUT_DEADMAN_S = 0.5
# A tenth of a second at 50 Hz: a host that stalls for a moment is no lost link, and a line that stays full is one.
_MOST_BUSY = 5
_LONGEST_PERIOD_S = 0.05
# A link that is lost sooner after it came back was never back: the outage and its pauses go on.
_SETTLED_S = 5.0


class ReconnectingLink(Link):
    """One robot's link, made anew by `make` after it failed; `clock` is the runtime's.

    A `send` or `service` that fails takes the link down, as do several `LinkBusyError` in a row. While it is down,
    `send` returns at once, counted in `dropped`; `service` tells the robot to stop, releases the old link, and tries
    to open a new one after 0.1 s, then after pauses that double up to 5 s, or up to 0.5 s where the robot has no
    deadman and drives on until then. Only `service` waits for any of that. After `give_up_s` without a link that holds
    `send` raises MtmError. A robot that somebody else has taken over is no lost link: TakenOverError goes to whoever
    called.

    `up_since_s` is when the link came up last on the runtime's clock, -inf for the first and None while it is down;
    that nothing moves before a base command has come over the new link is the runtime's part. `dropped` counts commands
    that `send` took without an error and that never left, `losses` outages, and `fault` says why the link went down.
    Counters are those of all links that were in use, one after the other.
    """

    def __init__(self, make: Callable[[], Link], clock: Clock, *, give_up_s: float = math.inf) -> None:
        self.dropped = 0
        self.losses = 0
        self.fault = ""
        self.up_since_s: float | None = -math.inf
        self._make = make
        self._clock = clock
        self._give_up_s = give_up_s
        self._lock = threading.Lock()
        self._link: Link | None = make()
        self._engaged = False
        self._counted_before: dict[str, int] = {}
        self._told_to_stop = True
        self._busy = 0
        self._out_since_s = self._next_try_s = 0.0
        self._pause_s = _FIRST_PAUSE_S
        self.service_period_s = min(_LONGEST_PERIOD_S, self._link.service_period_s)
        self.write_bound_s = self._link.write_bound_s
        self.has_deadman = self._link.has_deadman

    @property
    def degraded(self) -> str:  # type: ignore[override]
        """What the link in use says of itself; empty while none is."""
        link = self._link
        return "" if link is None or self.up_since_s is None else link.degraded

    def counters(self) -> dict[str, int]:
        """Of this wrapper and, beside them, of all links that it has used."""
        link = self._link
        counted = dict(self._counted_before)
        for name, count in ({} if link is None else link.counters()).items():
            counted[name] = counted.get(name, 0) + count
        return {"link_losses": self.losses, "dropped": self.dropped, **counted}

    def health(self) -> dict[str, int | float | str | bool]:
        """The counters, whether the link is up, degraded or down and why, and the states of the link in use."""
        link = self._link
        states = {} if link is None else link.health()
        is_up, doubt = self.up_since_s is not None, self.degraded
        own = {"link_up": is_up, "link_state": "degraded" if doubt else "up" if is_up else "down"}
        return own | {"link_trouble": doubt or self.fault} | states | self.counters()

    @property
    def link(self) -> Link | None:
        """The link in use, or the one that was lost until it is released."""
        return self._link

    def open(self) -> None:
        """Open the link; raises MtmError when that fails, which no waiting would mend."""
        link = self._link
        if link is not None and self.up_since_s is None:
            self._release(link)
            link = None
        if link is None:
            link = self._make()
        link.open()
        with self._lock:
            self._link = link
            self._engaged = True
            self._busy = 0
            if self.up_since_s is None:
                self.up_since_s = self._clock.now()

    def send(self, velocity: BodyVelocity) -> None:
        """Send one command, or drop and count it.

        Raises ValueError for values that no link takes, MtmError before `open`, after `stop`, and when the link has
        been down for `give_up_s`, and TakenOverError when somebody else has the robot.
        """
        if not velocity.is_finite():
            raise ValueError(f"the command {tuple(velocity)} is not finite; send finite speeds only")
        if not self._engaged:
            raise MtmError("The link to the robot is not open, or was stopped; open it before sending.")
        link = self._link
        if link is None or self.up_since_s is None:
            self.dropped += 1
            self._check_patience()
            return
        try:
            link.send(velocity)
        except (ValueError, TakenOverError):
            raise
        except Exception as error:
            self.dropped += 1
            self._busy += 1
            if not isinstance(error, LinkBusyError) or self._busy >= _MOST_BUSY:
                self._lose(link, error)
        else:
            self._busy = 0

    def stop(self) -> None:
        """Tell the robot to stop; `service` opens no link from now on.

        Raises MtmError when the link is down and the stop that was tried as it went down did not get through.
        """
        with self._lock:
            self._engaged = False
            link = self._link
        if link is not None:
            link.stop()
        elif not self._told_to_stop:
            raise MtmError(
                f"The link is down ({self.fault}), so the robot could not be told to stop; switch it off by hand."
            )

    def close(self) -> None:
        """Release the link."""
        with self._lock:
            self._engaged = False
            link = self._link
        if link is not None:
            link.close()

    def service(self, now_s: float) -> None:
        """Serve the link; when it is down, stop and release it, and open a new one when that is due.

        Raises TakenOverError when somebody else has taken the robot over.
        """
        link = self._link
        if link is not None and self.up_since_s is not None:
            try:
                link.service(now_s)
            except TakenOverError:
                raise
            except Exception as error:
                self._lose(link, error)
        elif link is not None:
            self._release(link)
        elif self._engaged and now_s >= self._next_try_s:
            self._reopen()

    def _lose(self, link: Link, error: Exception) -> None:
        with self._lock:
            if link is not self._link or self.up_since_s is None:
                return
            self.fault = str(error)
            self.losses += 1
            self._busy = 0
            now_s = self._clock.now()
            if now_s - self.up_since_s >= _SETTLED_S:
                self._out_since_s = now_s
                self._pause_s = _FIRST_PAUSE_S
            else:
                self._lengthen_pause()
            self._next_try_s = now_s + self._pause_s
            self.up_since_s = None

    def _release(self, link: Link) -> None:
        told = False
        # A lost link carries the stop no farther than it can; the robot's own deadman is what remains.
        with suppress(Exception):
            link.stop()
            told = True
        with suppress(Exception):
            link.close()
        with self._lock:
            # Before the link goes, so that nobody who asks meanwhile finds less than a moment ago.
            self._counted_before = {
                name: count for name, count in self.counters().items() if name not in ("link_losses", "dropped")
            }
            self._link = None
            self._told_to_stop = told

    def _reopen(self) -> None:
        link = None
        self._next_try_s = math.inf  # not again from within, where a link that waits has its clock call whom it serves
        try:
            link = self._make()
            link.resume()
        except Exception as error:
            if link is not None:
                with suppress(Exception):
                    link.close()
            if isinstance(error, TakenOverError):
                raise
            self.fault = str(error)
            self._lengthen_pause()
            self._next_try_s = self._clock.now() + self._pause_s
            return
        with self._lock:
            if self._engaged:
                self._link = link
                self.up_since_s = self._clock.now()
                return
        # The run ended while the link was being opened.
        try:
            link.stop()
        finally:
            link.close()

    def _check_patience(self) -> None:
        down_s = self._clock.now() - self._out_since_s
        if down_s >= self._give_up_s:
            raise MtmError(f"the link has been down for {down_s:.0f} s ({self.fault}); check the cable and the robot")

    def _lengthen_pause(self) -> None:
        longest_s = _LONGEST_PAUSE_S if self.has_deadman else _LONGEST_PAUSE_WITHOUT_DEADMAN_S
        self._pause_s = min(2.0 * self._pause_s, longest_s)
