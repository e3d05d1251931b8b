"""Whether a robot's configuration and its key fit each other."""

import math

import numpy as np

from mtm_onboard.doctor.finding import Finding
from mtm_onboard.model.velocity import AXES
from mtm_onboard.protocol import Channel, Key, MtmError, Scheme
from mtm_onboard.protocol.waveform import channel_tones
from mtm_onboard.runtime.config import RobotConfig

# Share of the ticks whose noise a limit may cut: above the first decoding gets worse, above the second it mostly fails.
_WARN_SHARE, _FAIL_SHARE = 0.01, 0.5


def check_fit(config: RobotConfig, key: Key) -> Finding:
    """Check that the channel is the key's, its axes are a body velocity's, and the limits do not cut its noise."""
    try:
        channel = key.scheme.channel(config.robot.channel)
    except MtmError as error:
        return Finding("fit", "fail", f"[robot] channel: {error}")
    strange = [axis for axis in channel.axes if axis not in AXES]
    if strange:
        return Finding(
            "fit", "fail",
            f"channel {channel.name} has the axis {strange[0]}, which no body velocity has; choose another channel",
        )  # fmt: skip
    if "vy" in channel.axes and config.transport_options.get("profile") == "rover":
        return Finding(
            "fit", "fail",
            f"channel {channel.name} moves the robot sideways, which a rover cannot; choose a channel on vx and wz",
        )  # fmt: skip
    return _check_limits(config, key.scheme, channel)


def _check_limits(config: RobotConfig, scheme: Scheme, channel: Channel) -> Finding:
    parts = _parts_cut(config, scheme, channel)
    limit, part = max(parts.items(), key=lambda item: item[1])
    figures = {"cut_part": round(part, 6)}
    if part <= _WARN_SHARE:
        return Finding(
            "fit", "pass",
            f"channel {channel.name} on {', '.join(channel.axes)}, sigma {channel.sigma_text}: at a standstill the "
            "limits leave the noise whole", figures,
        )  # fmt: skip
    return Finding(
        "fit", "fail" if part > _FAIL_SHARE else "warn",
        f"even at a standstill {limit} cuts the noise of channel {channel.name} in {100 * part:.0f}% of the ticks; "
        f"raise it, or make a key with a sigma below {channel.sigma_text}", figures,
    )  # fmt: skip


def _parts_cut(config: RobotConfig, scheme: Scheme, channel: Channel) -> dict[str, float]:
    """Part of the ticks that each limit cuts, by its name, for Gaussian noise around a standstill."""
    limits, sigmas = config.limits, dict(zip(channel.axes, channel.sigmas, strict=True))
    straight = len({"vx", "vy"} & set(channel.axes))
    # Of two that differ the larger is taken for both.
    sigma = max((sigmas[axis] for axis in ("vx", "vy") if axis in sigmas), default=1.0)
    inside = math.erf(limits.noise_sigmas / math.sqrt(2.0))
    parts = {
        "noise_sigmas": 1.0 - inside ** len(channel.axes),
        "speed_mps": _beyond(limits.speed_mps / sigma, straight),
        "turn_rate_radps": _beyond(limits.turn_rate_radps / sigmas.get("wz", 1.0), int("wz" in channel.axes)),
    }
    if limits.acceleration_mps2 is not None:
        step = limits.acceleration_mps2 / scheme.rate_hz
        parts["acceleration_mps2"] = _beyond(step / (sigma * _relative_change(scheme, channel)), straight)
    return parts


def _beyond(bound: float, axes: int) -> float:
    """Probability that the norm of `axes` unit Gaussians exceeds `bound`; 0 for no axes."""
    if axes == 0:
        return 0.0
    return math.exp(-0.5 * bound * bound) if axes == 2 else math.erfc(bound / math.sqrt(2.0))


def _relative_change(scheme: Scheme, channel: Channel) -> float:
    """Standard deviation of the noise's change from tick to tick, in sigmas."""
    if scheme.spectrum is not None:
        tones_hz, powers = channel_tones(scheme, channel)
        turns = (2.0 * math.pi / scheme.rate_hz) * tones_hz
        return math.sqrt(2.0 * (1.0 - float((powers * np.cos(turns)).mean())))
    # Power spread evenly over the band.
    low, high = (2.0 * math.pi * edge_hz / scheme.rate_hz for edge_hz in scheme.band_hz)
    correlation = (math.sin(high) - math.sin(low)) / (high - low)
    return math.sqrt(2.0 * (1.0 - correlation))
