"""When each robot was seen, and when the windows were that were read."""

import numpy as np
from matplotlib.axes import Axes

from mtm_audit.decoding.decoding import ChannelDecoding, Decoding
from mtm_audit.reporting.panels.rows import channel_note
from mtm_audit.reporting.panels.style import KEY_COLOUR, PLACES_NAMED, name_rows, plain, tidy

_SEEN, _FIRST = "#dbe4f0", "#e4572e"
_MOST_LETTERED = 60


def draw_timing(axes: Axes, decoding: Decoding) -> None:
    """A row for each channel. Without a message no windows are drawn: their places would be chance."""
    for row, item in enumerate(decoding.channels):
        axes.broken_barh(_seen_spans(item), (row - 0.4, 0.8), facecolors=_SEEN)
        if item.reading is not None and decoding.verdict != "absent":
            _draw_windows(axes, row, item, decoding)
        if item.glimpse is None and len(decoding.channels) <= PLACES_NAMED:
            axes.text(0.5, row, plain(channel_note(item, decoding)), ha="center", va="center", fontsize=9,
                      transform=axes.get_yaxis_transform())  # fmt: skip
    axes.set(title=_title(decoding), xlabel="time in the recording [s]")
    axes.set_ylim(len(decoding.channels) - 0.4, -0.6)
    notes = [channel_note(item, decoding) if item.glimpse is not None else "" for item in decoding.channels]
    name_rows(axes, [item.channel.name for item in decoding.channels], notes, "channel")
    tidy(axes)


def _title(decoding: Decoding) -> str:
    seen = "When each robot was seen (shaded)"
    return seen if decoding.verdict == "absent" else f"{seen}, and the windows that were read"


def _draw_windows(axes: Axes, row: int, item: ChannelDecoding, decoding: Decoding) -> None:
    """Outlined, each with its place in the message; a red line where the message begins."""
    assert item.reading is not None
    length_s = decoding.scheme.window_ticks(item.channel) / item.reading.timing.rate_hz
    starts_s, positions = item.reading.window_starts_s, item.reading.window_positions
    axes.broken_barh([(float(start_s), length_s) for start_s in starts_s], (row - 0.3, 0.6), facecolors="none",
                     edgecolors=KEY_COLOUR, linewidth=1.0)  # fmt: skip
    first_s = starts_s[positions == 0]
    axes.vlines(first_s, row - 0.4, row + 0.4, colors=_FIRST, linewidth=2.0)
    if len(starts_s) * len(decoding.channels) <= _MOST_LETTERED:
        for start_s, position in zip(starts_s, positions, strict=True):
            axes.text(start_s + 0.5 * length_s, row, str(position), ha="center", va="center", fontsize=9,
                      color=KEY_COLOUR, clip_on=True)  # fmt: skip


def _seen_spans(item: ChannelDecoding) -> list[tuple[float, float]]:
    """Begin and length of each span without a gap."""
    if item.glimpse is None:
        return []
    edges_s, valid = item.glimpse.edges_s, item.glimpse.valid
    turns = np.flatnonzero(np.diff(np.concatenate([[False], valid, [False]]).astype(np.int64)))
    return [
        (float(edges_s[begin]), float(edges_s[end] - edges_s[begin]))
        for begin, end in zip(turns[::2], turns[1::2], strict=True)
    ]
