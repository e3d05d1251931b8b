"""A recorded motion as it would have been had the robot played a message.

The noise passes through a linear response for each axis. In the world's frame it is added to the positions. In the
body's frame it is turned by the recorded heading; noise on `wz` adds to that heading and bends the path.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np

from hil.experiments.detectors.body_frame import known_headings, middles, turned
from hil.fleet.sending import STEP_S, Sending
from hil.plants.linear_response import LinearResponse
from mtm_audit.model.track import Floats, Track
from mtm_onboard.protocol import MtmError

Frame = Literal["world", "body"]


def with_message(track: Track, sending: Sending, responses: Mapping[str, LinearResponse], frame: Frame) -> Track:
    """The track with the message in it, at the recording's own instants.

    `responses` has one for each axis of the channel. Samples without a position, and in the body's frame those without
    a heading, are left out. Raises MtmError when the body's frame is asked for and fewer than three samples have a
    heading, or when `wz` is to be played in the world's frame.
    """
    axes = sending.channel.axes
    if frame == "world" and "wz" in axes:
        raise MtmError("noise on wz turns the robot, so that it has no meaning in the world's frame; take the body's")
    kept = track.valid if frame == "world" else track.valid & known_headings(track)
    times_s, positions = track.times_s[kept], track.positions[kept]
    added = dict(zip(axes, displacements(times_s, sending, responses).T, strict=True))
    still = np.zeros(len(times_s))
    shift = np.stack([added.get("vx", still), added.get("vy", still)], axis=1)
    headings = None if track.headings_rad is None else track.headings_rad[kept]
    if frame == "world":
        moved = positions + shift
    else:
        before = np.unwrap(track.headings_rad[kept])  # type: ignore[index]
        headings = before + added.get("wz", still)
        own = turned(np.diff(positions, axis=0), -middles(before)) + np.diff(shift, axis=0)
        moved = positions[0] + np.concatenate([[[0.0, 0.0]], np.cumsum(turned(own, middles(headings)), axis=0)])
    return replace(track, times_s=times_s, positions=moved, valid=np.ones(len(times_s), bool), headings_rad=headings)


def displacements(times_s: Floats, sending: Sending, responses: Mapping[str, LinearResponse]) -> Floats:
    """How far the noise alone has moved each axis of the channel at those instants, (n, axes), m or rad."""
    # Before the recording begins the robot has played for as long as any response lasts.
    grid_s = np.arange(times_s[0] - 3.0, times_s[-1] + 2 * STEP_S, STEP_S)
    noise = sending.noise(grid_s)
    columns = [
        np.interp(times_s, grid_s + STEP_S, STEP_S * np.cumsum(responses[axis].followed(column, STEP_S)))
        for axis, column in zip(sending.channel.axes, noise.T, strict=True)
    ]
    moved = np.stack(columns, axis=1)
    return np.asarray(moved - moved[0])
