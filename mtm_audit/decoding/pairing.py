"""Which free track shows which body, searched: all pairs are read, and the best one-to-one choice is taken.

The choice is made anew for the key and for each decoy, so that it is part of what a verdict compares.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from mtm_audit.detectors.base import ChannelReading, Observation
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Channel

# Reads observations under the key and all decoys.
Read = Callable[[Sequence[Observation]], list[ChannelReading | MtmError]]
Readings = list[list[ChannelReading | MtmError]]


@dataclass(frozen=True)
class Pairing:
    """What the search chose: `glimpses` by body, as the key chose; bodies for which no track was left are missing.

    `strengths` (1 + decoys,): sum over all channels read, the key's first, each under its own choice; `readings` by
    channel name, those of the key's choice.
    """

    glimpses: dict[str, Glimpse]
    strengths: Floats
    readings: dict[str, ChannelReading]


def search_pairs(
    channels: Sequence[Channel],
    glimpses: Sequence[Glimpse],
    read: Read,
    progress: Callable[[float], None] | None = None,
) -> Pairing:
    """Read every channel from every glimpse, and choose; channels of one body go together.

    Strengths are compared less the median that all codebooks reach on the same pair, so that a short or restless track
    does not draw every body. Raises MtmError when no pair can be read.
    """
    readings: Readings = []
    for number, channel in enumerate(channels):
        if progress is not None:
            progress(number / len(channels))
        readings.append(_read_apart([Observation(channel, glimpse) for glimpse in glimpses], read))
    strengths = _strengths(readings)
    levels = np.median(strengths, axis=0)
    bodies = list(dict.fromkeys(channel.body for channel in channels))
    owners = np.array([bodies.index(channel.body) for channel in channels])
    chosen, sums = choose_pairs(strengths - levels, owners)
    own = {body: int(place) for body, place in zip(bodies, chosen[0], strict=True) if place >= 0}
    found: dict[str, ChannelReading] = {}
    for row, channel in enumerate(channels):
        result = readings[row][own[channel.body]] if channel.body in own else None
        if isinstance(result, ChannelReading):
            found[channel.name] = result
            # The same for all codebooks, so it changes no comparison: sums read like those of ordinary strengths.
            sums = sums + levels[row, own[channel.body]]
    return Pairing({body: glimpses[place] for body, place in own.items()}, sums, found)


def choose_pairs(strengths: Floats, owners: NDArray[np.int64]) -> tuple[NDArray[np.int64], Floats]:
    """The one-to-one choice of tracks with the largest sum of strengths, for each codebook.

    `strengths` (codebooks, channels, tracks), NaN where a pair cannot be read; `owners` (channels,) numbers the body
    of each channel. Returns the track of each body, (codebooks, bodies), -1 for none, and the sums (codebooks,). As
    many bodies as possible get a track that can be read.
    """
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


def _read_apart(observations: Sequence[Observation], read: Read) -> list[ChannelReading | MtmError]:
    """Read together; one by one when that is refused, so that a track too short does not take the others along."""
    try:
        return read(observations)
    except MtmError as refusal:
        if len(observations) == 1:
            return [refusal]
    return [_read_apart([observation], read)[0] for observation in observations]


def _strengths(readings: Readings) -> Floats:
    """Strengths (1 + decoys, channels, tracks) of all pairs, NaN where a pair cannot be read."""
    read = [result for row in readings for result in row if isinstance(result, ChannelReading)]
    if not read:
        raise next(result for row in readings for result in row if isinstance(result, MtmError))
    unread = np.full(1 + len(read[0].decoy_strengths), np.nan)
    return np.stack(
        [[all_strengths(result) if isinstance(result, ChannelReading) else unread for result in row]
         for row in readings]
    ).transpose(2, 0, 1)  # fmt: skip


def all_strengths(result: ChannelReading) -> Floats:
    """Strengths (1 + decoys,), the key's first."""
    return np.concatenate([[result.reading.strength], result.decoy_strengths])
