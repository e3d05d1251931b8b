"""The C shim in the place of the modulator: same calls, same message, played by the microcontroller's code."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hil.vehicles.shim_library import load_shim
from mtm_onboard.firmware.image import MAX_Q20, ONE, Image, channel_image, image_bytes
from mtm_onboard.model.velocity import AXES, STOP, BodyVelocity
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.errors import MtmError

Floats = NDArray[np.float64]

_UNLIMITED = MAX_Q20 / ONE
_NO_DEADMAN_MS = (9_999, 10_000)
# The shim's timer tells forwards from backwards up to 2**31 microseconds.
_LONGEST_JUMP_S = 2_000


class ShimModulator:
    """Drop-in for `mtm_onboard.runtime.modulator.Modulator` on channels of a body velocity (vx, vy, wz).

    Limits and staleness are left to the runtime's own guard, so that the two differ in fixed-point rounding alone.
    Under the rolling schedule each message is an image of its own, and the next one waits in the shim's second
    buffer before it is due. Raises MtmError as Modulator and `channel_image` do, and without a C compiler or cffi.
    """

    def __init__(self, codebook: Codebook, channel_name: str, symbols: Sequence[int], *, repeat: bool = True) -> None:
        scheme = codebook.scheme
        if not isinstance(symbols, Sequence):
            raise MtmError("the shim plays the same symbols in every message; use the Python modulator for this scheme")
        self.channel = scheme.channel(channel_name)
        self.symbols = tuple(symbols)
        self.message_ticks = scheme.message_ticks
        self._codebook = codebook
        self._repeat = repeat
        self._rolling = scheme.schedule == "rolling"
        self._axes = [AXES.index(axis) for axis in self.channel.axes if axis in AXES]
        self._ffi, self._lib = load_shim()
        self._shim = self._ffi.new("mtm_shim *")
        self._base = self._ffi.new("mtm_velocity *")
        self._out = self._ffi.new("mtm_velocity *")
        self._images: dict[int, object] = {}
        self._rate_mhz = self._image(0).rate_mhz
        self._longest_jump = round(_LONGEST_JUMP_S * scheme.rate_hz)
        self._seat(0)

    def sends(self, tick: int) -> bool:
        """True when the message has noise at this tick: from tick 0 on, and without repeat up to its last tick."""
        return tick >= 0 and (self._repeat or tick < self.message_ticks)

    def perturbation(self, tick: int) -> Floats:
        """Noise of this tick in multiples of sigma, shape (axes,); zeros outside the message."""
        noise: Floats = np.array(self.add(tick, STOP))[self._axes] / np.array(self.channel.sigmas)
        return noise

    def substitute(self, tick: int, mean: Floats, sigma: Floats | float) -> Floats:
        """The action mean + sigma * eps of a Gaussian policy, with the keyed noise as its eps; shape (axes,)."""
        action: Floats = mean + sigma * self.perturbation(tick)
        return action

    def add(self, tick: int, base: BodyVelocity) -> BodyVelocity:
        """What the shim makes of `base` at this tick, in units of 2**-20; `base` itself outside the message."""
        if not self.sends(tick):
            return base
        if not self._last_tick <= tick < min(self._ready_until, self._last_tick + self._longest_jump):
            self._seat(tick)
        self._base.axis = [round(value * ONE) for value in base]
        self._play(tick)
        return BodyVelocity(*(value / ONE for value in self._out.axis))

    def require_body_axes(self) -> None:
        """Nothing to raise: a channel with other axes was refused when this was made."""

    def prepare(self, tick: int) -> None:
        """Offer the next message's image once the message of `tick` plays; called after the send."""
        if self._rolling and self._repeat and self._last_tick <= tick < self._ready_until:
            following = tick // self.message_ticks + 1
            if self._ready_until == following * self.message_ticks:
                self._offer(following)

    def _image(self, message: int) -> Image:
        return channel_image(
            self._codebook, self.channel.name, self.symbols, limits=(_UNLIMITED,) * 3, repeat=self._repeat,
            first_message=message if self._rolling else 0,
        )  # fmt: skip

    def _seat(self, tick: int) -> None:
        """Start the shim anew at the message that `tick` is in: at the beginning, and after a jump."""
        settings = self._ffi.new("mtm_settings *")
        settings.rate_mhz, settings.image_bytes_max = self._rate_mhz, 0xFFFFFFFF
        settings.hold_ms, settings.zero_ms = _NO_DEADMAN_MS
        settings.limit = [MAX_Q20] * len(AXES)
        self._check(self._lib.mtm_shim_init(self._shim, settings))
        message = tick // self.message_ticks
        self._images.clear()
        self._offer(message)
        self._play(message * self.message_ticks)

    def _offer(self, message: int) -> None:
        data = image_bytes(self._image(message))
        held = self._ffi.new("uint8_t[]", data)
        self._images = {number: kept for number, kept in self._images.items() if number >= message - 1}
        self._images[message] = held
        self._check(self._lib.mtm_shim_offer(self._shim, held, len(data)))
        self._ready_until = (message + 1) * self.message_ticks if self._rolling else float("inf")

    def _play(self, tick: int) -> None:
        now_us = (tick * 1_000_000_000 // self._rate_mhz) & 0xFFFFFFFF
        self._lib.mtm_shim_tick(self._shim, now_us, self._base, self._out)
        self._last_tick = tick

    def _check(self, result: int) -> None:
        if result != self._lib.MTM_OK:
            raise MtmError(f"the C shim refused the image (result {result}); export with the same version of both")
