"""What each symbol scored, and how far the best one is ahead."""

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.reporting.panels.rows import Row, score_rows
from mtm_audit.reporting.panels.style import (
    KEY_COLOUR,
    PLACES_NAMED,
    QUIET,
    TEXT_COLOUR,
    legend_below,
    name_rows,
    plain,
    tidy,
    written,
)

# More cells than this would be specks; numbers are written into fewer only.
_WRITTEN_CELLS = 48


def draw_scores(axes: Axes, decoding: Decoding) -> None:
    """A cell for each row and symbol. Only what was read for certain is framed; rows that nothing shows are grey."""
    rows = score_rows(decoding)
    table = np.array([row.scores for row in rows])
    low, high = float(np.nanmin(table)), float(np.nanmax(table))
    low -= 0.1 * abs(low)
    image = axes.imshow(
        np.ma.masked_invalid(table), aspect="auto", cmap=colormaps["Blues"].with_extremes(bad="#eceff3"), vmin=low,
        vmax=high, interpolation="nearest",
    )  # fmt: skip
    axes.figure.colorbar(image, ax=axes, shrink=0.85, label="score")
    if table.size <= _WRITTEN_CELLS:
        for (row, symbol), score in np.ndenumerate(table):
            if np.isfinite(score):
                colour = "white" if score > (low + high) / 2.0 else "#344054"
                axes.text(symbol, row, written(float(score)), ha="center", va="center", fontsize=9, color=colour)
    framed = [(row.symbol, number) for number, row in enumerate(rows) if row.symbol is not None]
    for symbol, number in framed:
        axes.add_patch(Rectangle((symbol - 0.47, number - 0.45), 0.94, 0.9, fill=False, edgecolor="#e4572e", lw=2.0))
    axes.set(title="What each symbol scored" + (" (framed: certain)" if framed else ""), xlabel="symbol")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    name_rows(axes, [row.name for row in rows], [row.note for row in rows])
    _tell_notes(axes, rows)


def draw_margins(axes: Axes, decoding: Decoding) -> None:
    """The best score beside the second best; of rows that are not certain no lead is drawn as one."""
    rows = score_rows(decoding)
    ranked = np.sort(np.nan_to_num(np.array([row.scores for row in rows])), axis=1)
    sure = [row.is_sure is not False and bool(np.isfinite(row.scores).all()) for row in rows]
    numbers = np.arange(len(rows))
    colours = [KEY_COLOUR if known else "#d5dbe3" for known in sure]
    axes.barh(numbers, ranked[:, -1], color=colours, height=0.62, label="best symbol")
    axes.barh(numbers, ranked[:, -2], color=QUIET, height=0.62, label="second best")
    if len(rows) <= PLACES_NAMED:
        for number, (row, (second, first)) in enumerate(zip(rows, ranked[:, -2:], strict=True)):
            lead = f"+{written(first - second)}" if sure[number] else "not certain"
            told = lead if np.isfinite(row.scores).all() else plain(row.note)
            axes.annotate(told, (max(first, 0.0), number), xytext=(4, 0), textcoords="offset points", va="center",
                          fontsize=9, color="#344054")  # fmt: skip
    axes.set(title="How far the best symbol is ahead", xlabel="score")
    axes.margins(x=0.2)
    axes.invert_yaxis()
    legend_below(axes)
    name_rows(axes, [row.name for row in rows])
    tidy(axes)


def _tell_notes(axes: Axes, rows: list[Row]) -> None:
    """Where rows are too many for names, name those that something is to be said of."""
    if len(rows) > PLACES_NAMED and (told := [f"{row.name} {row.note}" for row in rows if row.note]):
        axes.set_xlabel(f"symbol\n{plain('; '.join(told[:6]))}", color=TEXT_COLOUR)
