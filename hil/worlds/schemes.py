"""The paper's schemes of the four simulated worlds (its Section "Design Space": single, same, split)."""

from dataclasses import dataclass

from mtm_onboard.protocol import Channel, MtmError, Scheme
from mtm_onboard.protocol.scheme import Power


@dataclass(frozen=True)
class WorldSignal:
    """Rate, band, noise and channels of a world.

    Source: the paper's appendices "Policy and Controller Details" and "Detection Pipeline Details".

    `channels`: name, body and axes of each; `one_body` when they are all axes of the same body.
    """

    rate_hz: float
    band_hz: tuple[float, float]
    sigma: float
    channels: tuple[tuple[str, str, tuple[str, ...]], ...]
    one_body: bool
    power: Power = "window"


SIGNALS: dict[str, WorldSignal] = {
    "discovery": WorldSignal(
        10.0, (1.0, 2.0), 0.03, (("x", "agent", ("vx",)), ("y", "agent", ("vy",))), one_body=True
    ),
    "lunar-lander": WorldSignal(
        50.0, (0.5, 5.0), 0.5, (("side", "lander", ("vx",)), ("main", "lander", ("vy",))), one_body=True
    ),
    # In units of the policy's own standard deviation, which the keyed noise takes the place of.
    "reacher": WorldSignal(
        50.0, (0.5, 5.0), 1.0, (("inner", "arm", ("inner",)), ("outer", "arm", ("outer",))), one_body=True,
        power="ensemble",
    ),
    "football": WorldSignal(
        10.0, (1.0, 3.5), 0.3, tuple((f"agent{n}", f"agent{n}", ("vx", "vy")) for n in range(3)), one_body=False
    ),
}  # fmt: skip


def single_scheme(world: str, channel: str, alphabet_size: int, message_ticks: int, symbols: int) -> Scheme:
    """One channel carries the message; raises MtmError when the world has no such channel."""
    signal = SIGNALS[world]
    chosen = [entry for entry in signal.channels if entry[0] == channel]
    if not chosen:
        names = ", ".join(entry[0] for entry in signal.channels)
        raise MtmError(f"{world} has no channel {channel!r}; choose one of: {names}")
    return _scheme(world, alphabet_size, message_ticks, (Channel(*chosen[0], symbols, signal.sigma),))


def same_scheme(world: str, alphabet_size: int, message_ticks: int, symbols: int) -> Scheme:
    """All channels carry the whole message; those of one body are one channel of all its axes."""
    signal = SIGNALS[world]
    if signal.one_body:
        names, bodies, axes = zip(*signal.channels, strict=True)
        whole = Channel("+".join(names), bodies[0], tuple(axis for own in axes for axis in own), symbols, signal.sigma)
        return _scheme(world, alphabet_size, message_ticks, (whole,))
    channels = tuple(Channel(*entry, symbols, signal.sigma) for entry in signal.channels)
    return _scheme(world, alphabet_size, message_ticks, channels, same=True)


def split_scheme(world: str, alphabet_size: int, message_ticks: int, symbols: tuple[int, ...]) -> Scheme:
    """Each channel carries its own part, so many symbols each."""
    signal = SIGNALS[world]
    channels = tuple(
        Channel(*entry, count, signal.sigma) for entry, count in zip(signal.channels, symbols, strict=True)
    )
    return _scheme(world, alphabet_size, message_ticks, channels)


def _scheme(
    world: str, alphabet_size: int, message_ticks: int, channels: tuple[Channel, ...], *, same: bool = False
) -> Scheme:
    signal = SIGNALS[world]
    return Scheme(
        name=world,
        rate_hz=signal.rate_hz,
        band_hz=signal.band_hz,
        alphabet_size=alphabet_size,
        message_ticks=message_ticks,
        channels=channels,
        combine="same" if same else "split",
        power=signal.power,
    )
