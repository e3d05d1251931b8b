"""How all panels look, and names as their users wrote them."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation

VERDICT_COLOURS = {"decoded": "#1a7f37", "absent": "#b42318", "inconclusive": "#b54708"}
TRACK_COLOURS = ("#3366cc", "#dd7711", "#2a9d5c", "#b03a8c", "#7a5cc9", "#8a6d3b", "#0f8b8d", "#6b7280")
KEY_COLOUR, QUIET, TEXT_COLOUR, GRID_COLOUR = "#1d3557", "#a9b4c2", "#475467", "#e5e7eb"
# Rows with more names than this would be unreadable.
PLACES_NAMED, _ROWS_OF_TWO_LINES = 24, 6
# Tick labels and the label of the axis.
_LABELS_IN = 0.47


def plain(name: str) -> str:
    """A name that is drawn as it is: no dollar starts a formula, no underscore hides a line from the legend."""
    shown = "".join(letter if letter.isprintable() else "\ufffd" for letter in name).replace("$", r"\$")
    return f" {shown}" if shown.startswith("_") else shown


def written(score: float) -> str:
    """Coherencies lie below one, log-likelihood ratios in the hundreds."""
    return f"{score:.2f}" if abs(score) < 10.0 else f"{score:.0f}"


def name_rows(
    axes: Axes, names: Sequence[str], notes: Sequence[str] | None = None, what: str = "place in the message"
) -> None:
    """Name the rows, each with its note, or say what they are where there are too many."""
    if len(names) <= PLACES_NAMED:
        between = "\n" if len(names) <= _ROWS_OF_TWO_LINES else " "
        shown = [
            f"{plain(name)}{between}{plain(note)}" if note else plain(name)
            for name, note in zip(names, notes or [""] * len(names), strict=True)
        ]
        axes.set_yticks(range(len(names)), shown, fontsize=9)
    else:
        axes.set_ylabel(what)


def legend_below(axes: Axes) -> None:
    """The legend where it hides nothing: below the label of the axis, however high the axes are."""
    below = ScaledTranslation(0.0, -_LABELS_IN, axes.figure.dpi_scale_trans)
    axes.legend(fontsize=9, loc="upper center", bbox_to_anchor=(0.5, 0.0), bbox_transform=axes.transAxes + below,
                ncols=4, frameon=False)  # fmt: skip


def tidy(axes: Axes) -> None:
    """No frame above and at the right."""
    axes.spines[["top", "right"]].set_visible(False)
