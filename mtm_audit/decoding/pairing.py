"""The best one-to-one choice of tracks for bodies, by how strongly each track shows each channel.

The choice is made for the key and for each decoy alike, so that it is part of what decoys are compared by.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.track import Floats
from mtm_onboard.protocol.scheme import Channel


def best_pairs(channels: Sequence[Channel], strengths: Floats) -> tuple[dict[str, int], Floats]:
    """By body the number of its track, as the first codebook chooses, and each codebook's sum of strengths.

    `strengths` (codebooks, channels, tracks), NaN where a pair cannot be read; channels of one body go together. With
    decoys, strengths are compared less the median that all codebooks reach on the same pair, so that a short or
    restless track does not draw every body.
    """
    levels = np.zeros(strengths.shape[1:])
    if len(strengths) > 1:
        readable = np.isfinite(strengths).all(axis=0)
        levels[readable] = np.median(strengths[:, readable], axis=0)
    bodies = list(dict.fromkeys(channel.body for channel in channels))
    owners = np.array([bodies.index(channel.body) for channel in channels])
    chosen, sums = choose_pairs(strengths - levels, owners)
    found = {body: int(place) for body, place in zip(bodies, chosen[0], strict=True) if place >= 0}
    # The same for all codebooks, so it changes no comparison: sums read like those of ordinary strengths.
    for row, channel in enumerate(channels):
        if channel.body in found:
            sums = sums + levels[row, found[channel.body]]
    return found, sums


def choose_pairs(strengths: Floats, owners: NDArray[np.int64]) -> tuple[NDArray[np.int64], Floats]:
    """The one-to-one choice of tracks with the largest sum of strengths, for each codebook.

    `strengths` (codebooks, channels, tracks), NaN where a pair cannot be read; `owners` (channels,) numbers the body
    of each channel. Returns the track of each body, (codebooks, bodies), -1 for none, and the sums (codebooks,). As
    many bodies as possible get a track that can be read.
    """
    from scipy.optimize import linear_sum_assignment

    bodies = int(owners.max()) + 1
    readable = np.isfinite(strengths)
    worth = np.zeros((len(strengths), bodies, strengths.shape[2]))
    usable = np.zeros(worth.shape, dtype=np.bool_)
    for row, body in enumerate(owners):
        worth[:, body] += np.where(readable[:, row], strengths[:, row], 0.0)
        usable[:, body] |= readable[:, row]
    # No sum of readable pairs outweighs one that is not.
    forbidden = -1.0 - 2.0 * np.abs(worth).sum()
    chosen = np.full((len(strengths), bodies), -1)
    sums = np.zeros(len(strengths))
    for number, (table, allowed) in enumerate(zip(worth, usable, strict=True)):
        for body, track in zip(*linear_sum_assignment(np.where(allowed, table, forbidden), maximize=True), strict=True):
            if allowed[body, track]:
                chosen[number, body] = track
                sums[number] += table[body, track]
    return chosen, sums
