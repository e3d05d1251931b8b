"""Tracking a team by its members' colours, without the jumps of kick-offs, as the paper does for Football."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

import numpy as np

from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats, Track
from mtm_audit.tracking.colour import ColourTracker
from mtm_audit.tracking.cover import split_colours
from mtm_audit.tracking.gather import Progress

TEAM_COLOURS = ("cyan", "magenta", "yellow")
FULL_SEARCH_EVERY = 150  # the pictures are large and the colours nobody else's
LEAST_SHARE = 0.85  # of an agent's area that must show
# A step is a jump when it is longer than this and than so many of the steps before and after it.
LEAST_JUMP_PX = 6.0
TIMES_USUAL = 5.0
STEPS_AROUND = 4


def parse_football(text: str) -> "FootballTracker":
    """The tracker for a list of colours, or for the usual team's; raises MtmError when one is no colour."""
    return FootballTracker(split_colours(text) if text else TEAM_COLOURS)


class FootballTracker:
    """Follows one agent of each of `colours`: tracks `agent0`, `agent1` and so on in their order.

    When agents are put back to their places after a goal, the jump is taken out: from there on a track goes on from
    where it was, as fast as around the jump. Its positions are then not those in the picture, its motion is the
    agents' own. An agent that something covers in part is not valid meanwhile.
    """

    pixels: Literal["gray", "bgr"] = "bgr"

    def __init__(self, colours: tuple[str, ...] = TEAM_COLOURS) -> None:
        self._names = {colour: f"agent{number}" for number, colour in enumerate(colours)}
        self._tracker = ColourTracker(colours, FULL_SEARCH_EVERY, LEAST_SHARE)
        self.with_jumps: list[Track] = []

    def track(self, frames: Iterable[Frame], progress: Progress | None = None) -> list[Track]:
        """Track in `frames` of blue, green and red, in pixels with y up.

        Raises MtmError when none of the colours is found or the picture changes its size.
        """
        found = {self._names[track.name]: track for track in self._tracker.track(frames, progress)}
        self.with_jumps = [replace(found[name], name=name) for name in self._names.values() if name in found]
        return [without_jumps(track) for track in self.with_jumps]


def without_jumps(track: Track) -> Track:
    """The track with each jump replaced by the median velocity of the steps around it.

    A jump is a step between two sightings that exceeds `LEAST_JUMP_PX` and `TIMES_USUAL` times what the body goes in
    that time by the steps around it; a body that merely gets faster has fast steps after it.
    """
    seen = np.flatnonzero(track.valid)
    if len(seen) < 2 * STEPS_AROUND:
        return track
    durations_s = np.diff(track.times_s[seen])
    steps = np.diff(track.positions[seen], axis=0)
    around = _around(steps / durations_s[:, None]) * durations_s[:, None, None]
    usual_px = np.nanmedian(np.linalg.norm(around, axis=2), axis=1)
    lengths_px = np.linalg.norm(steps, axis=1)
    jumps = lengths_px > np.maximum(LEAST_JUMP_PX, TIMES_USUAL * usual_px)
    steps[jumps] = np.nanmedian(around[jumps], axis=1)
    positions = track.positions.copy()
    positions[seen[1:]] = positions[seen[0]] + np.cumsum(steps, axis=0)
    return replace(track, positions=positions)


def _around(velocities: Floats) -> Floats:
    """The velocities before and after each, (n, 2 STEPS_AROUND, axes); NaN beyond the ends."""
    padded = np.pad(velocities, ((STEPS_AROUND, STEPS_AROUND), (0, 0)), constant_values=np.nan)
    shifts = [shift for shift in range(2 * STEPS_AROUND + 1) if shift != STEPS_AROUND]
    return np.stack([padded[shift : shift + len(velocities)] for shift in shifts], axis=1)
