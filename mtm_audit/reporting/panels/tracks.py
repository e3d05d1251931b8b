"""Where the robots went, on paper or over a picture of the film."""

import numpy as np
from matplotlib.axes import Axes

from mtm_audit.model.track import Floats, Track
from mtm_audit.reporting.panels.style import GRID_COLOUR, TRACK_COLOURS, legend_below, plain, tidy

# More than a picture has columns; of a longer track every k-th position is drawn.
_MOST_POINTS = 4000
_MOST_NAMES = 40


def draw_tracks(axes: Axes, tracks: tuple[Track, ...], height_px: int | None = None) -> None:
    """Paths with their starts and ends. Tracks of a picture `height_px` high are drawn as it shows them, y down."""
    for number, track in enumerate(tracks):
        draw_track(axes, track, number, height_px)
    unit = tracks[0].unit
    way = ", upwards from the lowest row" if unit == "px" and height_px is None else ""
    axes.set(title="Where the robots went (● start, □ end)", xlabel=f"x [{unit}]", ylabel=f"y [{unit}{way}]")
    axes.set_aspect("equal", adjustable="datalim")
    if height_px is not None:
        axes.invert_yaxis()
    axes.grid(color=GRID_COLOUR, linewidth=0.8)
    axes.set_axisbelow(True)
    if len(tracks) <= len(TRACK_COLOURS):
        legend_below(axes)
    tidy(axes)


def draw_tracks_over(axes: Axes, tracks: tuple[Track, ...], size_px: tuple[int, int]) -> None:
    """Paths over a picture of that width and height, each with its name at its start."""
    width_px, height_px = size_px
    for number, track in enumerate(tracks):
        start = draw_track(axes, track, number, height_px)
        if start is None or len(tracks) > _MOST_NAMES:
            continue
        axes.annotate(
            plain(track.name), start, xytext=(6, 6), textcoords="offset points", fontsize=8, color=_colour(number),
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5}, annotation_clip=True,
        )  # fmt: skip
    axes.set(xlim=(-0.5, width_px - 0.5), ylim=(height_px - 0.5, -0.5), xlabel="x [px]", ylabel="y [px]")
    axes.tick_params(labelsize=8)


def draw_track(axes: Axes, track: Track, number: int, height_px: int | None) -> tuple[float, float] | None:
    """One path in the colour of its number; returns where it starts, None when it was never seen."""
    x, y = _plane(track, height_px)
    colour = _colour(number)
    seen = np.flatnonzero(track.valid)
    every = max(1, len(x) // _MOST_POINTS)
    # Positions that were not observed are NaN, which breaks the line.
    axes.plot(x[::every], y[::every], color=colour, linewidth=1.6, label=plain(track.name))
    if not len(seen):
        return None
    axes.plot(x[seen[0]], y[seen[0]], "o", color=colour, markersize=6)
    axes.plot(x[seen[-1]], y[seen[-1]], "s", color=colour, markersize=6, markerfacecolor="white")
    return float(x[seen[0]]), float(y[seen[0]])


def _colour(number: int) -> str:
    return TRACK_COLOURS[number % len(TRACK_COLOURS)]


def _plane(track: Track, height_px: int | None) -> tuple[Floats, Floats]:
    """The first two axes; trackers count y upwards from the lowest row of the picture."""
    x, y = track.positions[:, 0], track.positions[:, min(1, track.positions.shape[1] - 1)]
    return x, (y if height_px is None else height_px - 1.0 - y)
