"""What a person should know beside the verdict: where recording, scheme and reading do not fit together."""

import numpy as np

from mtm_audit.decoding.decoding import ChannelDecoding, Decoding
from mtm_audit.model.recording import Recording
from mtm_audit.reporting.advice import advice

_RATE_TOLERANCE = 0.02
_GAP_SHARE = 0.2


def remarks(recording: Recording, decoding: Decoding) -> tuple[str, ...]:
    """One sentence for each thing that does not fit, the recording's own warnings first."""
    found = [*recording.warnings, *_of_the_recording(recording, decoding)]
    if decoding.verdict != "absent":
        found += _of_exchanged_tracks(decoding)
    for channel in decoding.channels:
        found += _of_a_channel(channel, decoding)
    return (*found, *advice(recording, decoding))


def _of_the_recording(recording: Recording, decoding: Decoding) -> list[str]:
    scheme, found = decoding.scheme, []
    found += [
        f"track {name} leaps {'once' if count == 1 else f'{count} times'}, farther than it ever moves in one step; the "
        "observations after a leap were left out"
        for name, count in decoding.leaps.items()
    ]
    message_s = scheme.message_ticks / scheme.rate_hz
    if recording.duration_s < message_s:
        found.append(
            f"the recording lasts {recording.duration_s:.1f} s and one message {message_s:g} s, so part of it is "
            "missing; record longer"
        )
    needed_hz, rate_hz = 2.0 * scheme.band_hz[1], recording.frame_rate_hz
    if rate_hz is not None and rate_hz < needed_hz:
        found.append(
            f"{rate_hz:.1f} observations a second are too few for a band up to {scheme.band_hz[1]:g} Hz; record with "
            f"at least {needed_hz:g}"
        )
    return found


def _of_exchanged_tracks(decoding: Decoding) -> list[str]:
    """Which bodies are in other tracks than names say; two that are in each other's are told together."""
    tracks = {
        item.channel.body: item.glimpse.name
        for item in decoding.channels
        if item.exchanged and item.glimpse is not None
    }
    found, told = [], set()
    for body, track in tracks.items():
        other = next((name for name in tracks if name != body and tracks[name] == body and track == name), None)
        if other is not None and body not in told:
            found.append(f"{body} and {other} are exchanged: each one's motion is in the track named after the other")
            told |= {body, other}
        elif body not in told:
            says = "it was assigned another" if body in decoding.settings.assignment else "names say otherwise"
            found.append(f"{body} is the track {track}, though {says}: its motion is there")
    return found


def _of_a_channel(decoding: ChannelDecoding, whole: Decoding) -> list[str]:
    channel, glimpse, reading = decoding.channel, decoding.glimpse, decoding.reading
    if glimpse is None:
        return [f"no track shows {channel.body}, so channel {channel.name} was not read; film it, or use --assign"]
    found = []
    # Gaps are few and long, ordinary intervals many and short, so time and not count says how much was missed.
    missed = float(np.sum(glimpse.durations_s[~glimpse.valid]) / np.sum(glimpse.durations_s))
    if missed > _GAP_SHARE:
        found.append(
            f"{channel.body} was out of sight for {missed:.0%} of the time between its first and last sighting"
        )
    if reading is None:
        return [*found, decoding.refusal or f"track {glimpse.name} is too short to read channel {channel.name}"]
    if decoding.also_shows and whole.verdict != "absent":
        found.append(f"track {glimpse.name} plays channel {decoding.also_shows}, which is not that of {channel.body}")
    nominal_hz = whole.scheme.rate_hz
    # Without a message the rate found is that of chance.
    if whole.verdict != "absent" and abs(reading.timing.rate_hz / nominal_hz - 1.0) > _RATE_TOLERANCE:
        found.append(
            f"channel {channel.name} seems to run at {reading.timing.rate_hz:.2f} Hz instead of {nominal_hz:g} Hz; "
            "check the recording's time stamps and the robot's clock"
        )
    return found
