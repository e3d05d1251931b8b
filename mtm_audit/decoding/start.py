"""Which message slots a recording may show, by when it was made."""

from collections.abc import Iterable
from dataclasses import dataclass

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.timing import Onset, OnsetRange
from mtm_audit.model.track import Track
from mtm_onboard.protocol import MtmError, Scheme
from mtm_onboard.protocol.slots import slot_at, slot_start_unix_s


@dataclass(frozen=True)
class Start:
    """Which message slot a codebook's windows count from, and when that slot began in the recording's clock."""

    first_slot: int
    onset: Onset


def start_of(scheme: Scheme, tracks: Iterable[Track], onset_s: float | None, at: RecordedAt | None) -> Start:
    """What to search for: under the rolling schedule the slots that the recording may show, by its time.

    An onset that is given names the slot that begins nearest to it. Under the fixed schedule time does not matter.
    Raises MtmError when the onset comes after the end, when the rolling schedule is used and nobody says when the
    recording was made, and when no slot begins near the given onset.
    """
    tracks = tuple(tracks)
    _check_within(tracks, onset_s)
    if scheme.schedule == "fixed":
        return Start(0, onset_s)
    if at is None:
        raise MtmError(
            "this key's schedule is rolling, so that its waveforms follow the clock; say when the recording was made "
            "with --at"
        )
    if onset_s is not None:
        return _named_slot(scheme, onset_s, at)
    first_s = min((float(track.times_s[0]) for track in tracks if len(track.times_s)), default=0.0)
    slot = max(0, slot_at(at.unix_s + first_s - at.error_s, scheme))
    nominal_s = slot_start_unix_s(slot, scheme) - at.unix_s
    return Start(slot, OnsetRange(nominal_s - at.error_s, nominal_s + at.error_s))


def _check_within(tracks: Iterable[Track], onset_s: float | None) -> None:
    ends_s = [float(track.times_s[-1]) for track in tracks if len(track.times_s)]
    if onset_s is not None and ends_s and onset_s >= max(ends_s):
        raise MtmError(
            f"the recording ends at {max(ends_s):g} s of its own time, before the onset of {onset_s:g} s; give --onset "
            "in that time, or leave it out"
        )


def _named_slot(scheme: Scheme, onset_s: float, at: RecordedAt) -> Start:
    half_slot_s = 0.5 * scheme.message_ticks / scheme.rate_hz
    slot = max(0, slot_at(at.unix_s + onset_s + half_slot_s, scheme))
    off_s = abs(slot_start_unix_s(slot, scheme) - at.unix_s - onset_s)
    if off_s > at.error_s + 1.0 / scheme.rate_hz:
        raise MtmError(
            f"no message of this key begins at {onset_s:g} s of the recording: the nearest one is {off_s:.1f} s away; "
            "leave --onset out, or correct --at"
        )
    return Start(slot, onset_s)
