"""Evidence against time: what each window adds."""

import math

import numpy as np
from matplotlib.axes import Axes
from scipy.special import logsumexp

from mtm_audit.decoding.decoding import ChannelDecoding, Decoding
from mtm_audit.model.track import Floats
from mtm_audit.reporting.panels.style import GRID_COLOUR, TRACK_COLOURS, legend_below, plain, tidy


def has_growth(decoding: Decoding) -> bool:
    """Whether windows have log-likelihood ratios, and a message is there that they speak of."""
    return decoding.verdict != "absent" and decoding.evidence.nats is not None


def draw_growth(axes: Axes, decoding: Decoding) -> None:
    """Each channel's log-likelihood ratio of any symbol, added up over its windows, in bits; it steps as they end."""
    for number, item in enumerate(decoding.channels):
        if item.reading is None or not len(item.reading.window_starts_s):
            continue
        ends_s, bits = grown_bits(item, decoding)
        begin_s = float(item.reading.window_starts_s.min())
        axes.plot([begin_s, *ends_s], [0.0, *bits], drawstyle="steps-post", linewidth=1.6, marker="o", markersize=4.5,
                  color=TRACK_COLOURS[number % len(TRACK_COLOURS)], label=plain(item.channel.name))  # fmt: skip
    axes.set(title="Evidence against time", xlabel="time in the recording [s]", ylabel="bits, added up")
    axes.grid(color=GRID_COLOUR, linewidth=0.8)
    axes.set_axisbelow(True)
    if len(decoding.channels) <= 2 * len(TRACK_COLOURS):
        legend_below(axes)
    tidy(axes)


def grown_bits(item: ChannelDecoding, decoding: Decoding) -> tuple[Floats, Floats]:
    """When each window of a channel that was read ends, ascending, and the bits of all up to it.

    Each adds the log of the mean of its likelihood ratios over all symbols, so that none is singled out.
    """
    assert item.reading is not None
    scores = item.reading.window_scores
    each = (logsumexp(scores, axis=1) - math.log(scores.shape[1])) / math.log(2.0)
    length_s = decoding.scheme.window_ticks(item.channel) / item.reading.timing.rate_hz
    ends_s = item.reading.window_starts_s + length_s
    order = np.argsort(ends_s)
    return ends_s[order], np.cumsum(each[order])
