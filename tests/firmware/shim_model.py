"""What the shim should do, in Python's exact integers, written from the header and not from the C."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from mtm_onboard.firmware.image import ONE, Image, channel_image
from mtm_onboard.protocol import Channel, Codebook, MtmError, Scheme

Q20 = tuple[int, int, int]
WIDE_LIMITS = (20.0, 20.0, 20.0)


class ShimModel:
    """The playing core: one image after another, the timer given without wrapping."""

    def __init__(self, rate_mhz: int, limits_q20: Sequence[int], hold_ms: int = 100, zero_ms: int = 250) -> None:
        self.rate = Fraction(rate_mhz, 10**9)
        self.own_limits = self.limits = list(limits_q20)
        self.hold_us, self.zero_us = hold_ms * 1000, zero_ms * 1000
        self.base: list[int] = [0, 0, 0]
        self.good_us: int | None = None
        self.images: list[Image] = []
        self.start: tuple[int, int] | None = None
        self.clamps = 0

    def offer(self, image: Image) -> None:
        self.images.append(image)

    def tick(self, now_us: int, base: Sequence[int] | None) -> list[int]:
        noise = self._noise(now_us)
        if base is not None:
            self.base = [self._limit(value, axis) for axis, value in enumerate(base)]
            self.good_us = now_us
        age_us = self.zero_us if self.good_us is None else now_us - self.good_us
        if age_us < self.hold_us:
            return [self._limit(value + noise[axis], axis) for axis, value in enumerate(self.base)]
        gain = max(0, (self.zero_us - age_us) * 256 // (self.zero_us - self.hold_us))
        return [int(Fraction(value * gain, 256)) for value in self.base]

    def _noise(self, now_us: int) -> list[int]:
        if self.images and self.start is None:
            self.start = (now_us, 0)
            self._begin()
        while self.images:
            assert self.start is not None
            image, (start_us, played) = self.images[0], self.start
            total = image.samples.shape[1]
            index = int((now_us - start_us) * self.rate + Fraction(1, 2)) - played
            if index < total:
                return image_noise(image, index)
            if len(self.images) == 1 and image.repeats:
                self.start = (start_us, played + index // total * total)
                return image_noise(image, index % total)
            self.images.pop(0)
            self.start = (start_us, played + total) if self.images else None
            self._begin()
        return [0, 0, 0]

    def _begin(self) -> None:
        if self.images:
            self.limits = [min(*pair) for pair in zip(self.own_limits, self.images[0].limits_q20, strict=True)]
            self.base = [self._limit(value, axis) for axis, value in enumerate(self.base)]

    def _limit(self, value: int, axis: int) -> int:
        limited = max(-self.limits[axis], min(self.limits[axis], value))
        self.clamps += limited != value
        return limited


def image_noise(image: Image, index: int) -> list[int]:
    """Noise of one tick of the image for vx, vy, wz, in 2**-20."""
    noise, row = [], 0
    for step in image.steps:
        size = 0
        if step:
            sample = int(image.samples[row, index])
            size = (abs(sample) * step * 2 + (1 << 16)) // (1 << 17) * (1 if sample >= 0 else -1)
            row += 1
        noise.append(size)
    return noise


def random_image(
    rng: np.random.Generator, longest_ticks: int = 150
) -> tuple[Codebook, Channel, tuple[int, ...], Image]:
    """A playable scheme drawn at random, one message of it, and the image of that message."""
    while True:
        rate_hz = float(rng.choice([1.0, 10.0, 29.97, 50.0, 100.0, 333.333, 1000.0]))
        low, high = np.sort(rng.uniform(0.01, 0.45, 2)) * rate_hz
        symbols = int(rng.integers(1, 4))
        axes = tuple(rng.permutation(["vx", "vy", "wz"])[: rng.integers(1, 4)].tolist())
        sigma = float(10 ** rng.uniform(-4, 1.5))
        rolling = bool(rng.integers(2))
        messages = int(rng.integers(1, 4)) if rolling else 1
        ticks = symbols * int(rng.integers(8, max(9, longest_ticks // (symbols * messages))))
        channels = (Channel("other", "a", ("x",), 1, 1.0), Channel("robot", "b", axes, symbols, sigma))
        try:
            scheme = Scheme(
                name="random",
                rate_hz=rate_hz,
                band_hz=(float(low), float(high)),
                alphabet_size=int(rng.integers(2, 300)),
                message_ticks=ticks,
                channels=channels,
                power="window" if rng.integers(2) else "ensemble",
                schedule="rolling" if rolling else "fixed",
                epoch=int(rng.integers(1 << 40)),
            )
        except MtmError:
            continue
        codebook = Codebook(rng.bytes(32), scheme)
        message = tuple(int(symbol) for symbol in rng.integers(scheme.alphabet_size, size=symbols))
        first = int(rng.integers(1000)) if rolling else 0
        limit = float(10 ** rng.uniform(-1, 2))
        image = channel_image(
            codebook, "robot", message, limits=(limit, limit, limit), first_message=first, messages=messages
        )
        return codebook, channels[1], message, image


def float_noise(codebook: Codebook, channel: Channel, message: Sequence[int], image: Image) -> np.ndarray:
    """Sigma * x[t] in floating point for vx, vy, wz: shape (ticks of the image, 3)."""
    first = image.first_message * channel.symbols
    windows = range(first, first + image.messages * channel.symbols)
    parts = [codebook.samples(channel, window, [message[window % channel.symbols]])[0] for window in windows]
    noise = np.zeros((image.samples.shape[1], 3))
    noise[:, [("vx", "vy", "wz").index(axis) for axis in channel.axes]] = channel.sigma * np.concatenate(parts, 1).T
    return noise


def largest_unit_q20(image: Image) -> list[float]:
    """One least significant bit of each axis' samples in 2**-20, never below the output's own unit."""
    return [max(step / (1 << 16), 1.0) for step in image.steps]


def in_q20(values: Sequence[float]) -> list[int]:
    return [round(value * ONE) for value in values]
