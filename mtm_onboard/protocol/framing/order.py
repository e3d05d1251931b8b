"""The order in which a frame's symbols are played: dealt over channels and time, and differently in every slot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.protocol.framing.framing import layout_of

if TYPE_CHECKING:
    from mtm_onboard.protocol.scheme import Scheme

# Turning by this part of a circle again and again leaves the largest gaps between the places visited.
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def frame_order(scheme: Scheme, slot: int) -> NDArray[np.int64]:
    """Permutation (L,): the symbol played at message position p of that slot is frame[order[p]].

    Without interleaving it is the identity, and under the fixed schedule `slot` counts as 0. The channel symbols of
    one code symbol stay together, on one channel and one after the other where its number of windows allows: what
    hides a body or a moment then spoils few code symbols. Code symbols are dealt to the channels in turn as time goes
    on, and from slot to slot they move on by about 0.618 of the codeword, so that an occlusion in step with the
    message hides other ones in each repetition.
    """
    count = scheme.message_symbols
    framing = scheme.framing
    if framing is None or not framing.interleave:
        return np.arange(count)
    layout = layout_of(framing, scheme.alphabet_size, count)
    turn = 0 if scheme.schedule == "fixed" else slot % layout.code_symbols * _step(layout.code_symbols)
    carrying = layout.code_symbols * layout.group
    order = np.empty(count, dtype=np.int64)
    for place, position in enumerate(_dealt_positions(scheme, layout.group)):
        order[position] = (place + turn * layout.group) % carrying if place < carrying else place
    return order


def _dealt_positions(scheme: Scheme, group: int) -> list[int]:
    """Message positions by time, `group` consecutive windows of a channel at once; what is left over comes last."""
    channels = scheme.channels[:1] if scheme.combine == "same" else scheme.channels
    runs: list[tuple[bool, int, int, list[int]]] = []
    for index, channel in enumerate(channels):
        first, window_ticks = scheme.first_position(channel), scheme.window_ticks(channel)
        for start in range(0, channel.symbols, group):
            run = list(range(first + start, first + min(start + group, channel.symbols)))
            runs.append((len(run) < group, start * window_ticks, index, run))
    return [position for *_, run in sorted(runs) for position in run]


def _step(count: int) -> int:
    """The smallest number from 0.618 `count` on that has no divisor in common with it, so that all turns are used."""
    step = max(1, round(_GOLDEN * count))
    while math.gcd(step, count) != 1:
        step += 1
    return step
