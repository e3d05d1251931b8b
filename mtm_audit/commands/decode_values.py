"""What a decode's options may be, asked before any work, since it would fail after the long part of it."""

from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.speeds import check_speed
from mtm_audit.detectors import make_detector
from mtm_audit.readers.video.clock import EvenClock
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol.errors import command_line_values


def check_decode_values(
    settings: DecodeSettings, tracker_name: str, speed: float | None, frame_rate_hz: float | None
) -> None:
    """Raise WrongValueError for a detector, tracker, speed or frame rate that there is not."""
    make_detector(settings.detector, settings.profile)
    with command_line_values():
        tracker(tracker_name)
        check_speed(1.0 if speed is None else speed)
        if frame_rate_hz is not None:
            EvenClock(frame_rate_hz)
