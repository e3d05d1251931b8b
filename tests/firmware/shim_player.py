"""The C shim behind the calls of `ShimModel`, for tests that compare the two."""

from collections.abc import Sequence

from hil.vehicles.shim_library import load_shim
from mtm_onboard.firmware.image import Image, image_bytes


class ShimPlayer:
    """Owns the C state and the images' bytes, which must outlive their playing."""

    def __init__(
        self, rate_mhz: int, limits_q20: Sequence[int], hold_ms: int = 100, zero_ms: int = 250, room: int = 1 << 24
    ) -> None:
        self.ffi, self.lib = load_shim()
        self.shim = self.ffi.new("mtm_shim *")
        self.settings = self.ffi.new("mtm_settings *", [rate_mhz, room, hold_ms, zero_ms, list(limits_q20)])
        self.started = self.lib.mtm_shim_init(self.shim, self.settings)
        self._base, self._out = self.ffi.new("mtm_velocity *"), self.ffi.new("mtm_velocity *")
        self._kept: list[object] = []

    @property
    def counts(self):
        return self.shim.counts

    def offer(self, image: Image | bytes) -> int:
        data = image if isinstance(image, bytes) else image_bytes(image)
        held = self.ffi.new("uint8_t[]", data) if data else self.ffi.NULL
        self._kept.append(held)
        return self.lib.mtm_shim_offer(self.shim, held, len(data))

    def tick(self, now_us: int, base: Sequence[int] | None) -> list[int]:
        if base is not None:
            self._base.axis = base
        given = self.ffi.NULL if base is None else self._base
        self.lib.mtm_shim_tick(self.shim, now_us & 0xFFFFFFFF, given, self._out)
        return list(self._out.axis)
