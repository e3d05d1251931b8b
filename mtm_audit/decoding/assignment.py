"""Which track shows which channel's body."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.model.track import Track
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Scheme

# Each pair is read as a channel of its own, decoys included; a film of fourteen robots without names comes to this.
MOST_PAIRS = 200
# What extends less than this part of what the farthest track does stands still.
_STANDING = 0.02


@dataclass(frozen=True)
class Assignment:
    """`settled` bodies with the track that shows each; `unsettled` bodies, to be searched among the `free` tracks."""

    settled: Mapping[str, Track]
    unsettled: tuple[str, ...]
    free: tuple[Track, ...]


def assign_tracks(scheme: Scheme, tracks: Sequence[Track], chosen: Mapping[str, str] | None = None) -> Assignment:
    """What choice, names and numbers say about which track shows which body of the scheme.

    `chosen` maps bodies to track names and comes first. Then equal names count, then equal trailing numbers (body
    robot2, marker2), and last a single body with a single track. What stands still while others move is never settled
    by its name: a marker on the floor may have any number. No track is given to two bodies. Raises MtmError
    when a chosen name does not exist or is chosen twice, when there is no track, or when so much is left open that
    `MOST_PAIRS` would not suffice to search it.
    """
    bodies = list(dict.fromkeys(channel.body for channel in scheme.channels))
    free = {track.name: track for track in tracks}
    if not free:
        raise MtmError(f"the recording has no track that could show {', '.join(bodies)}; record them in sight")
    settled = _chosen(bodies, free, chosen or {})
    moving = _moving(tracks)
    for body in bodies:
        if body not in settled and body in free and body in moving:
            settled[body] = free.pop(body)
    for body in bodies:
        candidates = [track for track in free.values() if track.name in moving]
        number_match = None if body in settled else _same_number(body, candidates)
        if number_match is not None:
            settled[body] = free.pop(number_match.name)
    if len(bodies) == len(tracks) == 1 and free and not settled:
        settled[bodies[0]] = free.pop(tracks[0].name)
    unsettled = tuple(body for body in bodies if body not in settled)
    _check_pairs(scheme, unsettled, len(free))
    return Assignment(settled, unsettled, tuple(free.values()))


def _moving(tracks: Sequence[Track]) -> set[str]:
    """Names of the tracks that go somewhere, beside the one that goes farthest; markers on the floor do not."""
    reaches = {track.name: _reach(track) for track in tracks}
    least = _STANDING * max(reaches.values(), default=0.0)
    return {name for name, reach in reaches.items() if reach >= least}


def _reach(track: Track) -> float:
    """How far a track extends, its farthest hundredths left out."""
    seen = track.positions[track.valid]
    return float(np.linalg.norm(np.ptp(np.quantile(seen, (0.02, 0.98), axis=0), axis=0))) if len(seen) else 0.0


def _chosen(bodies: Sequence[str], free: dict[str, Track], chosen: Mapping[str, str]) -> dict[str, Track]:
    """The pairs chosen by hand; their tracks leave `free`."""
    settled: dict[str, Track] = {}
    names = sorted(free)
    for body, name in chosen.items():
        if body not in bodies:
            raise MtmError(f"the scheme has no body {body!r}; its bodies are: {', '.join(bodies)}")
        if name not in names:
            raise MtmError(f"the recording has no track {name!r}; it has: {', '.join(names)}")
        if name not in free:
            raise MtmError(f"track {name!r} is given to two bodies; give each its own")
        settled[body] = free.pop(name)
    return settled


def _check_pairs(scheme: Scheme, unsettled: Sequence[str], free: int) -> None:
    pairs = free * sum(channel.body in unsettled for channel in scheme.channels)
    if pairs > MOST_PAIRS:
        raise MtmError(
            f"{len(unsettled)} bodies and {free} tracks are left to match by search, {pairs} pairs, and no more than "
            f"{MOST_PAIRS} can be searched; name pairs with --assign BODY=TRACK, or leave tracks out"
        )


def _same_number(body: str, tracks: Sequence[Track]) -> Track | None:
    number = _trailing_number(body)
    matches = [track for track in tracks if number is not None and _trailing_number(track.name) == number]
    return matches[0] if len(matches) == 1 else None


def _trailing_number(name: str) -> int | None:
    digits = re.search(r"(\d+)$", name)
    return int(digits.group(1)) if digits else None
