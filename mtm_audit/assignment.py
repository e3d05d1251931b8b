"""Which track shows which channel's body."""

import re
from collections.abc import Mapping, Sequence

from mtm_audit.tracks import Track
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Scheme


def assign_tracks(
    scheme: Scheme, tracks: Sequence[Track], chosen: Mapping[str, str] | None = None
) -> dict[str, Track | None]:
    """For each body of the scheme its track, or None when nothing shows it.

    `chosen` maps bodies to track names and comes first. Then equal names count, then equal trailing numbers (body
    robot2, marker2), and last a single body with a single track. No track is given to two bodies. Raises MtmError
    when a chosen name does not exist or is chosen twice, or when no body has a track.
    """
    bodies = list(dict.fromkeys(channel.body for channel in scheme.channels))
    by_name = {track.name: track for track in tracks}
    found: dict[str, Track | None] = dict.fromkeys(bodies)
    free = dict(by_name)
    for body, name in (chosen or {}).items():
        if body not in found:
            raise MtmError(f"the scheme has no body {body!r}; its bodies are: {', '.join(bodies)}")
        if name not in by_name:
            raise MtmError(f"the recording has no track {name!r}; it has: {', '.join(sorted(by_name))}")
        if name not in free:
            raise MtmError(f"track {name!r} is given to two bodies; give each its own")
        found[body] = free.pop(name)
    for body in bodies:
        if found[body] is None and body in free:
            found[body] = free.pop(body)
    for body in bodies:
        number_match = _same_number(body, list(free.values())) if found[body] is None else None
        if number_match is not None:
            found[body] = free.pop(number_match.name)
    if len(bodies) == len(tracks) == 1 and found[bodies[0]] is None:
        found[bodies[0]] = tracks[0]
    if all(track is None for track in found.values()):
        raise MtmError(
            f"no track belongs to a body of the scheme: the recording has {', '.join(sorted(by_name)) or 'none'}, the "
            f"scheme has {', '.join(bodies)}; name the pairs with --assign BODY=TRACK"
        )
    return found


def _same_number(body: str, tracks: Sequence[Track]) -> Track | None:
    number = _trailing_number(body)
    matches = [track for track in tracks if number is not None and _trailing_number(track.name) == number]
    return matches[0] if len(matches) == 1 else None


def _trailing_number(name: str) -> int | None:
    digits = re.search(r"(\d+)$", name)
    return int(digits.group(1)) if digits else None
