"""The scheme: every parameter that robot and auditor agree on. It holds no secret."""

import hashlib
import json
import math
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal, get_args

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.framing.framing import Framing, layout_of
from mtm_onboard.protocol.spectrum import Points, check_points, points_from_table

SCHEME_VERSION = 1
Combine = Literal["split", "same"]
Pooling = Literal["mean", "majority"]
Power = Literal["ensemble", "window"]
Schedule = Literal["fixed", "rolling"]

_MAX_ALPHABET = 65_536
# Far above any robot's; with these no product of the two overflows, and the tones can be counted one by one.
_MAX_RATE_HZ = 1e6
_MAX_MESSAGE_TICKS = 1 << 22
_MIN_TONES = 2


@dataclass(frozen=True)
class Channel:
    """Axes of one body that carry the same symbol together.

    `axes` name commanded degrees of freedom ("vx", "vy", a joint); `symbols` is the paper's l_c, the number of
    symbols this channel sends in one message; `sigma` is the standard deviation of the noise in the unit of the
    command (m/s, rad/s, N m), one for all axes or one for each. `body` names the thing that a tracker follows.
    """

    name: str
    body: str
    axes: tuple[str, ...]
    symbols: int
    sigma: float | tuple[float, ...]

    @property
    def sigmas(self) -> tuple[float, ...]:
        """The standard deviation of the noise on each axis, (axes,)."""
        return self.sigma if isinstance(self.sigma, tuple) else (self.sigma,) * len(self.axes)

    @property
    def sigma_text(self) -> str:
        """The sigma for people: one number, or one for each axis."""
        return ", ".join(f"{sigma:g}" for sigma in (self.sigmas if isinstance(self.sigma, tuple) else [self.sigma]))

    def on(self, axes: tuple[str, ...]) -> "Channel":
        """The channel with some of its axes only."""
        each = tuple(sigma for axis, sigma in zip(self.axes, self.sigmas, strict=True) if axis in axes)
        return replace(self, axes=axes, sigma=each if isinstance(self.sigma, tuple) else self.sigma)


@dataclass(frozen=True, kw_only=True)
class Scheme:
    """Every agreed parameter: rate and band in hertz, alphabet size M, message length T in ticks, channels.

    `combine` is "split" (each channel carries its own part of the message) or "same" (all carry all of it, and
    the auditor pools by `pooling`). `power` and `schedule` are explained in `waveform` and `codebook`. `framing` says
    what a message's symbols spell; None is a plain number. `spectrum` is points (Hz, dB) of the noise's power over the
    band, see `spectrum`; None is flat.
    Raises MtmError on construction when the scheme cannot be played.
    """

    name: str
    rate_hz: float
    band_hz: tuple[float, float]
    alphabet_size: int
    message_ticks: int
    channels: tuple[Channel, ...]
    combine: Combine = "split"
    pooling: Pooling = "mean"
    power: Power = "window"
    schedule: Schedule = "fixed"
    epoch: int = 0
    framing: Framing | None = None
    spectrum: Points | None = None
    version: int = SCHEME_VERSION

    def __post_init__(self) -> None:
        _check(self)

    def window_ticks(self, channel: Channel) -> int:
        """Ticks of one symbol on this channel: T / l_c."""
        return self.message_ticks // channel.symbols

    def channel(self, name: str) -> Channel:
        """The channel of that name; raises MtmError when there is none."""
        for channel in self.channels:
            if channel.name == name:
                return channel
        known = ", ".join(channel.name for channel in self.channels)
        raise MtmError(f"the scheme has no channel {name!r}; choose one of: {known}")

    def axis_index(self, channel: Channel) -> int:
        """Number of the channel's first axis, counted over all channels in order (the waveform's `c`).

        A channel with some of the axes only, in their order and next to each other, counts from the first of these.
        """
        place = self.channel_number(channel)
        before = sum(len(other.axes) for other in self.channels[:place])
        return before + self.channels[place].axes.index(channel.axes[0])

    def first_position(self, channel: Channel) -> int:
        """Position in the message of the first symbol of the channel; 0 when all channels carry the same."""
        if self.combine == "same":
            return 0
        return sum(other.symbols for other in self.channels[: self.channel_number(channel)])

    def channel_number(self, channel: Channel) -> int:
        """Which of the channels has this one's name; it may have some of the axes only."""
        return [other.name for other in self.channels].index(channel.name)

    @property
    def message_symbols(self) -> int:
        """L: symbols of a whole message."""
        if self.combine == "same":
            return self.channels[0].symbols
        return sum(channel.symbols for channel in self.channels)

    @property
    def fingerprint(self) -> str:
        """Sixteen hexadecimal digits that differ when any parameter differs; safe to publish."""
        parameters = asdict(self)
        # A scheme without framing or spectrum keeps the fingerprint that it had before there was any.
        for name in ("framing", "spectrum"):
            if parameters[name] is None:
                del parameters[name]
        canonical = json.dumps(parameters, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(canonical.encode()).hexdigest()[:16]


def shortest_window(rate_hz: float, band_hz: tuple[float, float], below: int = 1 << 20) -> int | None:
    """Smallest number of ticks whose in-band bins number two or more; None when there is none up to `below`."""
    low, high = band_hz
    # Two bins need a width of one spacing at least, so the search can begin there and ends within two spacings of low.
    start = max(5, math.floor(rate_hz / max(high, 1e-12)))
    for ticks in range(start, min(below, math.ceil(4 * rate_hz / max(high - low, 1e-12)) + start + 8)):
        if count_bins(ticks, rate_hz, band_hz) >= _MIN_TONES:
            return ticks
    return None


def count_bins(ticks: int, rate_hz: float, band_hz: tuple[float, float]) -> int:
    """Number of bins 0 < k < ticks/2 with band_lo <= k * rate_hz / ticks <= band_hi."""
    low, high = band_hz
    first = max(1, math.floor(low * ticks / rate_hz) - 1)
    last = min((ticks - 1) // 2, math.ceil(high * ticks / rate_hz) + 1)
    return sum(low <= k * rate_hz / ticks <= high for k in range(first, last + 1))


def scheme_from_table(table: dict[str, Any]) -> Scheme:
    """Build a scheme from a parsed TOML table; raises MtmError that names the field to change."""
    known = {field.name for field in fields(Scheme)}
    _refuse_unknown(table, known, "the scheme")
    if table.get("version") != SCHEME_VERSION:
        raise MtmError(
            f"the scheme is of version {table.get('version')!r}, this program reads {SCHEME_VERSION}; "
            "provision the key anew with this version of mtm-onboard keygen"
        )
    required = {"name", "rate_hz", "band_hz", "alphabet_size", "message_ticks", "channels"}
    missing = sorted(required - table.keys())
    if missing:
        raise MtmError(f"the scheme lacks {', '.join(missing)}; add it")
    entries = table["channels"]
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise MtmError("the scheme's channels must be a list of tables ([[scheme.channels]])")
    band = table["band_hz"]
    if not isinstance(band, list) or len(band) != 2:
        raise MtmError("the scheme's band_hz must be two numbers: [low, high]")
    built = ("channels", "band_hz", "framing", "spectrum")
    plain = {name: value for name, value in table.items() if name not in built}
    return Scheme(
        **plain,
        band_hz=(band[0], band[1]),
        channels=tuple(_channel_from_table(entry) for entry in entries),
        framing=_framing_from_table(table["framing"]) if "framing" in table else None,
        spectrum=points_from_table(table["spectrum"]) if "spectrum" in table else None,
    )


def _framing_from_table(table: object) -> Framing:
    if not isinstance(table, dict):
        raise MtmError("the scheme's framing must be a table ([scheme.framing])")
    _refuse_unknown(table, {field.name for field in fields(Framing)}, "the scheme's framing")
    missing = sorted({"payload", "payload_bits"} - table.keys())
    if missing:
        raise MtmError(f"the scheme's framing lacks {', '.join(missing)}; add it")
    return Framing(**table)


def _channel_from_table(table: dict[str, Any]) -> Channel:
    names = {field.name for field in fields(Channel)}
    _refuse_unknown(table, names, "a channel of the scheme")
    missing = sorted(names - table.keys())
    if missing:
        raise MtmError(f"a channel of the scheme lacks {', '.join(missing)}; add it")
    axes = table["axes"]
    if not isinstance(axes, list):
        raise MtmError("a channel's axes must be a list of names")
    sigma = tuple(table["sigma"]) if isinstance(table["sigma"], list) else table["sigma"]
    return Channel(table["name"], table["body"], tuple(axes), table["symbols"], sigma)


def _refuse_unknown(table: dict[str, Any], known: set[str], where: str) -> None:
    unknown = sorted(table.keys() - known)
    if unknown:
        raise MtmError(f"{where} has an unknown field {unknown[0]!r}; remove it or correct its spelling")


def _check(scheme: Scheme) -> None:
    _check_types(scheme)
    _check_band(scheme)
    if scheme.spectrum is not None:
        check_points(scheme.spectrum)
    if not 2 <= scheme.alphabet_size <= _MAX_ALPHABET:
        raise MtmError(f"alphabet_size is {scheme.alphabet_size}; choose 2 to {_MAX_ALPHABET}")
    if scheme.message_ticks > _MAX_MESSAGE_TICKS:
        raise MtmError(f"message_ticks is {scheme.message_ticks}; choose {_MAX_MESSAGE_TICKS} at most")
    if not scheme.channels:
        raise MtmError("the scheme has no channel; add at least one")
    for label in ("name", "body"):
        values = [getattr(channel, label) for channel in scheme.channels]
        if label == "name" and len(set(values)) != len(values):
            raise MtmError("two channels have the same name; give each its own")
    for channel in scheme.channels:
        _check_channel(scheme, channel)
    if scheme.combine == "same" and len({channel.symbols for channel in scheme.channels}) > 1:
        raise MtmError('combine = "same" needs the same number of symbols on every channel; make them equal')
    if scheme.framing is not None:
        layout_of(scheme.framing, scheme.alphabet_size, scheme.message_symbols)


def _check_types(scheme: Scheme) -> None:
    for label, values in (("combine", Combine), ("pooling", Pooling), ("power", Power), ("schedule", Schedule)):
        if getattr(scheme, label) not in get_args(values):
            raise MtmError(f"{label} is {getattr(scheme, label)!r}; choose one of: {', '.join(get_args(values))}")
    numbers = {"rate_hz": scheme.rate_hz, "band_hz low": scheme.band_hz[0], "band_hz high": scheme.band_hz[1]}
    for channel in scheme.channels:
        each = dict(enumerate(channel.sigma)) if isinstance(channel.sigma, tuple) else {None: channel.sigma}
        of = {place: "" if place is None else f" of axis {place + 1}" for place in each}
        numbers |= {f"sigma{of[place]} of channel {channel.name!r}": sigma for place, sigma in each.items()}
    for label, value in numbers.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value <= 0:
            raise MtmError(f"{label} is {value!r}; give a number above zero")
    integers = {"alphabet_size": scheme.alphabet_size, "message_ticks": scheme.message_ticks, "epoch": scheme.epoch}
    integers |= {f"symbols of channel {channel.name!r}": channel.symbols for channel in scheme.channels}
    for label, value in integers.items():
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 1 << 63:
            raise MtmError(f"{label} is {value!r}; give a whole number")
    texts = [scheme.name, *(text for channel in scheme.channels for text in (channel.name, channel.body))]
    texts += [axis for channel in scheme.channels for axis in channel.axes]
    for text in texts:
        if not isinstance(text, str) or not text or not text.isprintable() or '"' in text or "\\" in text:
            raise MtmError(f"{text!r} cannot be a name; use printable text without quotes or backslashes")


def _check_band(scheme: Scheme) -> None:
    low, high = scheme.band_hz
    if scheme.rate_hz > _MAX_RATE_HZ:
        raise MtmError(f"rate_hz is {scheme.rate_hz:g}; choose {_MAX_RATE_HZ:g} at most")
    if low >= high:
        raise MtmError(f"band_hz is [{low}, {high}]; put the lower edge first")
    if high >= scheme.rate_hz / 2:
        raise MtmError(
            f"the band ends at {high} Hz but a {scheme.rate_hz} Hz loop plays only what is below "
            f"{scheme.rate_hz / 2} Hz; lower band_hz or raise rate_hz"
        )


def _check_channel(scheme: Scheme, channel: Channel) -> None:
    if not channel.axes or len(set(channel.axes)) != len(channel.axes):
        raise MtmError(f"channel {channel.name!r} needs one or more axes, each named once")
    if len(channel.sigmas) != len(channel.axes):
        raise MtmError(
            f"channel {channel.name!r} has {len(channel.axes)} axes and {len(channel.sigmas)} sigmas; give one sigma "
            "for all axes, or one for each"
        )
    if channel.symbols < 1:
        raise MtmError(f"channel {channel.name!r} sends {channel.symbols} symbols; give it at least 1 or remove it")
    if scheme.message_ticks < 1 or scheme.message_ticks % channel.symbols:
        nearest = max(1, round(scheme.message_ticks / channel.symbols)) * channel.symbols
        raise MtmError(
            f"{scheme.message_ticks} message_ticks do not divide into {channel.symbols} equal windows on channel "
            f"{channel.name!r}; {nearest} would"
        )
    ticks = scheme.window_ticks(channel)
    if count_bins(ticks, scheme.rate_hz, scheme.band_hz) < _MIN_TONES:
        shortest = shortest_window(scheme.rate_hz, scheme.band_hz)
        remedy = f"the shortest window that works is {shortest} ticks" if shortest else "widen the band"
        raise MtmError(
            f"a window of {ticks} ticks on channel {channel.name!r} holds fewer than two tones of the band "
            f"{scheme.band_hz[0]}-{scheme.band_hz[1]} Hz; {remedy}"
        )
