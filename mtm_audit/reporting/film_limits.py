"""What motion a film can carry, beside what the message should move a robot by."""

import numpy as np

from mtm_audit.model.recording import Recording
from mtm_onboard.protocol.scheme import Channel, Scheme
from mtm_onboard.protocol.waveform import channel_tones

_MARKER_M = 0.1
# A marker must be this wide to be read at all.
_READABLE_PX = 20.0
_VELOCITIES = frozenset({"vx", "vy", "vz"})
CODEC_NAMES = {"h264": "H.264", "hevc": "HEVC", "av1": "AV1", "libdav1d": "AV1", "vp9": "VP9", "mjpeg": "MJPEG"}


def film_limits(recording: Recording, scheme: Scheme) -> tuple[str, ...]:
    """One sentence for a film whose compression is known; nothing for other recordings."""
    found = recording.compression
    if found is None:
        return ()
    low_px, high_px = found.smallest_motion_px
    quantiser = "" if found.quantiser is None else f" (quantiser {found.quantiser:.0f})"
    codec = CODEC_NAMES.get(found.codec, found.codec)
    carried = (
        f"the film is {codec} at {found.bits_per_pixel:.2g} bits a pixel{quantiser}: "
        f"motion of a sharp marker below {low_px:.2f} to {high_px:.2f} px is lost in it, and several times as much of "
        "small or soft things"
    )
    quiet = [channel for channel in scheme.channels if set(channel.axes) <= _VELOCITIES]
    if not quiet:
        return (carried,)
    moved_m = min(displacement_m(channel, scheme) for channel in quiet)
    marker_px = _MARKER_M * high_px / moved_m
    moved = f"{carried}; the message moves a robot that follows it by {1000.0 * moved_m:.2g} mm root mean square, which"
    if marker_px < _READABLE_PX:
        return (f"{moved} is not lost where a marker of 10 cm can be read",)
    return (f"{moved} is lost unless a marker of 10 cm is {marker_px:.0f} px wide or more",)


def displacement_m(channel: Channel, scheme: Scheme) -> float:
    """Root mean square displacement along one axis that a channel's noise commands, in metres.

    The mean square is sigma^2 times the mean of 1 / (2 pi f)^2 over the band, where each tone counts by its power.
    """
    if scheme.spectrum is not None:
        tones_hz, powers = channel_tones(scheme, channel)
        return float(min(channel.sigmas) * np.sqrt(np.mean(powers / (2.0 * np.pi * tones_hz) ** 2)))
    low_hz, high_hz = scheme.band_hz
    return float(min(channel.sigmas) / (2.0 * np.pi * np.sqrt(low_hz * high_hz)))
