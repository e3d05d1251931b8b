"""Kinds of motion that carry the same symbols: a robot's velocities and its turning.

Each has a plant and interference of its own and is read by itself, with what the others say of its symbols.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from mtm_audit.detectors.base import Reading
from mtm_audit.detectors.matched.byclock import Found
from mtm_audit.detectors.matched.windows import Window
from mtm_audit.model.timing import Timing
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.scheme import Channel

# Windows of two kinds of motion that begin within this of each other are the same.
_SAME_WINDOW_S = 0.3


def reading_order(
    kinds: Sequence[Sequence[int]], channels: dict[int, Channel], searched: dict[int, list[Found]]
) -> list[Sequence[int]]:
    """In which order kinds of motion are read: where one channel shows in several the strongest comes first, and again
    at the end, since what the others say of its symbols helps it to learn the plant.
    """
    names = [{channels[number].name for number in numbers} for numbers in kinds]
    if sum(len(each) for each in names) == len(set().union(*names)):
        return list(kinds)
    order = sorted(kinds, key=lambda numbers: -sum(searched[number][0].evidence for number in numbers))
    return [*order, order[0]]


def elsewhere(
    windows: Sequence[Window], names: Sequence[str], timings: Sequence[Timing], others: Mapping[str, Reading]
) -> list[Floats] | None:
    """What other motion says of each window's symbol, (M,) nats; zeros where it shows no such window."""
    if not others:
        return None
    found: list[Floats] = []
    for window in windows:
        said: Floats = np.broadcast_to(0.0, len(window.tones))
        other = others.get(names[window.observation])
        if other is not None:
            start_s = timings[window.observation].onset_s + window.number * window.length_s
            same = (other.window_numbers == window.number) & (np.abs(other.window_starts_s - start_s) < _SAME_WINDOW_S)
            rows = np.flatnonzero(same)
            # Mostly it is a single window, which need not be held twice.
            said = other.window_scores[rows[0]] if len(rows) == 1 else other.window_scores[rows].sum(axis=0)
        found.append(said)
    return found
