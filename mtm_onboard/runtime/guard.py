"""The guard: what may be sent. When anything is wrong the noise goes first and the base command stays.

Motion itself stops only when the base command is stale or the operator says stop.

The guard of the microcontroller (`firmware_shim`, `mtm_shim.h`) ages and fades base commands alike and refuses what is
not finite alike, and differs in these limits: it bounds each axis by itself, so that (vx, vy) may reach the square root
of two times a limit that here bounds their norm; it cuts the sum of base and noise axis by axis, where here the noise
is shortened along its direction; the noise of an axis is bounded by the image; changes from tick to tick are not
bounded; and its stop can be released.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

from mtm_onboard.model.velocity import AXES, STOP, BodyVelocity
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.journal_file import CLAMPED, HELD, NOISE, REFUSED, STALE, STOPPED, UNSENT
from mtm_onboard.protocol.scheme import Channel

# Instants are sums of decimal fractions, so an age that is within this of a bound has reached it.
_HAIR_S = 1e-9


@dataclass(frozen=True)
class Limits:
    """Bounds of what is sent: norm of (vx, vy), turn rate, noise of one axis in multiples of sigma, acceleration.

    The acceleration limit bounds the change of (vx, vy) from one command to the next; it never delays a stop.
    Raises MtmError for a bound that is not a number above zero.
    """

    speed_mps: float
    turn_rate_radps: float
    noise_sigmas: float = 4.0
    acceleration_mps2: float | None = None

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise MtmError(f"the limit {entry.name} is {value}; give a number above zero")


@dataclass(frozen=True)
class Staleness:
    """Ages of the base command at which the noise ends and at which a ramp from there has reached zero."""

    noise_off_s: float = 0.1
    stopped_s: float = 0.25

    def __post_init__(self) -> None:
        if not 0 < self.noise_off_s < self.stopped_s < math.inf:
            raise MtmError(
                f"noise_off_s is {self.noise_off_s} and stopped_s {self.stopped_s}; give two ages above zero, the "
                "noise off before the stop"
            )


def body_sigmas(channels: Sequence[Channel]) -> tuple[float, float, float]:
    """The sigma of the noise that channels of one body put on vx, vy and wz; 0 where they put none."""
    vx, vy, wz = (
        max((dict(zip(each.axes, each.sigmas, strict=True)).get(axis, 0.0) for each in channels), default=0.0)
        for axis in AXES
    )
    return vx, vy, wz


class Guard:
    """Holds the limits and the newest good base command; one `admit` and one `limit` a tick.

    `noise_sigma` is the sigma of the noise, one for all axes or one for each of vx, vy and wz (see `body_sigmas`), and
    `period_s` the control period. Counters: `clamped`, `stale`, `refused`, `held` and `unsent` ticks. `flags` tells
    what happened in the tick at hand, in the bits of `mtm_onboard.protocol.journal_file`.
    """

    def __init__(
        self, limits: Limits, staleness: Staleness, *, noise_sigma: float | tuple[float, float, float], period_s: float
    ) -> None:
        self.flags = 0
        self.clamped = self.stale = self.refused = self.held = self.unsent = 0
        self._speed = limits.speed_mps
        self._turn = limits.turn_rate_radps
        each = noise_sigma if isinstance(noise_sigma, tuple) else (noise_sigma,) * len(AXES)
        self._noise = tuple(limits.noise_sigmas * sigma for sigma in each)
        self._step = math.inf if limits.acceleration_mps2 is None else limits.acceleration_mps2 * period_s
        self._noise_off_s = staleness.noise_off_s
        self._stopped_s = staleness.stopped_s
        self._base = self._last = self._before_last = STOP
        self._arrived_s = -math.inf
        self._stopped = False

    @property
    def stopped(self) -> bool:
        """True once the operator has said stop; nothing takes it back."""
        return self._stopped

    def stop(self) -> None:
        """Latch the operator's stop."""
        self._stopped = True

    def age_s(self, now_s: float) -> float:
        """Age of the newest good base command, infinite before any."""
        return now_s - self._arrived_s

    def is_stale(self, now_s: float) -> bool:
        """Whether that is so old that the noise is off."""
        return self.age_s(now_s) + _HAIR_S >= self._noise_off_s

    @property
    def noise_allowed(self) -> bool:
        """False in a tick whose base command is stale, refused, held or overruled by a stop."""
        return not self.flags & (STALE | STOPPED | REFUSED | HELD)

    def admit(self, base: BodyVelocity, arrived_s: float, now_s: float, *, after_s: float = -math.inf) -> BodyVelocity:
        """The base command to send at `now_s`: within the limits, ramped down when old, zero after a stop.

        A non-finite command is refused and the last good one goes on ageing in its place. Of commands that did not
        arrive after `after_s` none is admitted, and the robot is held at a standstill.
        """
        self.flags = 0
        if self._stopped:
            self.flags = STOPPED
            return STOP
        # A sum of finite speeds is finite and one NaN or infinity makes it not so: one test for three.
        if math.isfinite(base[0] + base[1] + base[2]):
            self._base, self._arrived_s = base, arrived_s
        else:
            self.refused += 1
            self.flags = REFUSED
        if self._arrived_s <= after_s != -math.inf:
            self.held += 1
            self.flags |= HELD
            return STOP
        age_s = now_s - self._arrived_s + _HAIR_S
        vx_mps, vy_mps, wz_radps = self._base
        kept = 1.0
        if not age_s < self._noise_off_s:
            self.stale += 1
            self.flags |= STALE
            if not age_s < self._stopped_s:
                return STOP
            kept = (self._stopped_s - age_s) / (self._stopped_s - self._noise_off_s)
        speed_mps = math.hypot(vx_mps, vy_mps)
        if speed_mps <= self._speed and abs(wz_radps) <= self._turn:
            return self._base if kept == 1.0 else BodyVelocity(kept * vx_mps, kept * vy_mps, kept * wz_radps)
        self._count_clamp()
        scale = kept * min(1.0, self._speed / speed_mps) if speed_mps else kept
        turn_radps = kept * max(-self._turn, min(self._turn, wz_radps))
        return BodyVelocity(scale * vx_mps, scale * vy_mps, turn_radps)

    def limit(self, base: BodyVelocity, wanted: BodyVelocity) -> BodyVelocity:
        """What is sent: `base`, as admitted, and as much of the noise `wanted - base` as every limit allows."""
        sent = base if wanted is base or not self.noise_allowed else self._with_noise(base, wanted)
        if self._step < math.inf and not self.flags & (STALE | STOPPED | HELD):
            sent = self._slewed(base, sent)
        self._before_last, self._last = self._last, sent
        return sent

    def not_sent(self) -> None:
        """Say that this tick's command never left: the robot still has the one before it."""
        self.unsent += 1
        self.flags |= UNSENT
        self._last = self._before_last

    def _with_noise(self, base: BodyVelocity, wanted: BodyVelocity) -> BodyVelocity:
        base_x, base_y, base_z = base
        want_x, want_y, want_z = wanted
        x, y, z = want_x - base_x, want_y - base_y, want_z - base_z
        if not math.isfinite(x + y + z):
            self.refused += 1
            self.flags |= REFUSED
            return base
        self.flags |= NOISE
        most_x, most_y, most_z = self._noise
        calm = -most_x <= x <= most_x and -most_y <= y <= most_y and -most_z <= z <= most_z
        slow = want_x * want_x + want_y * want_y <= self._speed * self._speed
        if calm and slow and -self._turn <= want_z <= self._turn:
            return wanted
        self._count_clamp()
        x, y, z = (max(-most, min(most, value)) for most, value in zip(self._noise, (x, y, z), strict=True))
        part = _part_within(base_x, base_y, x, y, self._speed)
        turn_radps = max(-self._turn, min(self._turn, base_z + z))
        return BodyVelocity(base_x + part * x, base_y + part * y, turn_radps)

    def _slewed(self, base: BodyVelocity, sent: BodyVelocity) -> BodyVelocity:
        last_x, last_y, _ = self._last
        if math.hypot(sent[0] - last_x, sent[1] - last_y) <= self._step:
            return sent
        self._count_clamp()
        x, y = base[0] - last_x, base[1] - last_y
        distance = math.hypot(x, y)
        if distance > self._step:
            self.flags &= ~NOISE
            part = self._step / distance
            return BodyVelocity(last_x + part * x, last_y + part * y, base[2])
        noise_x, noise_y = sent[0] - base[0], sent[1] - base[1]
        part = _part_within(x, y, noise_x, noise_y, self._step)
        return BodyVelocity(base[0] + part * noise_x, base[1] + part * noise_y, sent[2])

    def _count_clamp(self) -> None:
        if not self.flags & CLAMPED:
            self.clamped += 1
            self.flags |= CLAMPED


def _part_within(x: float, y: float, dx: float, dy: float, radius: float) -> float:
    """Largest part of the step (dx, dy), 0 to 1, that keeps (x, y), itself within `radius`, within `radius`."""
    if (x + dx) ** 2 + (y + dy) ** 2 <= radius * radius:
        return 1.0
    square = dx * dx + dy * dy
    if square == 0.0:
        return 0.0
    along = x * dx + y * dy
    room = max(0.0, radius * radius - x * x - y * y)
    return max(0.0, min(1.0, (math.sqrt(along * along + square * room) - along) / square))
