"""The report's pictures as SVG to be put into a page: text stays text, and nothing in it is fetched."""

import base64
import io
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Rectangle

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.model.recording import Recording
from mtm_audit.reporting.panels.evidence import draw_evidence
from mtm_audit.reporting.panels.growth import draw_growth, has_growth
from mtm_audit.reporting.panels.scores import draw_scores
from mtm_audit.reporting.panels.style import TEXT_COLOUR, plain
from mtm_audit.reporting.panels.timing import draw_timing
from mtm_audit.reporting.panels.tracks import draw_tracks, draw_tracks_over
from mtm_audit.reporting.still import Still, region_of, still_of

_WIDTH_IN = 7.6
_LEAST_HEIGHT_IN, _ROW_IN, _FURNITURE_IN, _MOST_HEIGHT_IN = 2.6, 0.3, 1.5, 9.0
_LEFT_IN, _RIGHT_IN, _BELOW_IN, _ABOVE_IN, _MOST_DOWN_IN = 0.6, 0.15, 0.8, 0.1, 5.0
_STILL_ID = "still"
# Nothing refers to these, and several figures in one page would repeat them.
_UNUSED_ID = re.compile(r' id="(?:figure|axes|patch|line2d|text|matplotlib\.axis|xtick|ytick|legend|QuadMesh)_\d+"')


@dataclass(frozen=True)
class Drawing:
    """A picture as an `svg` element, with its caption."""

    svg: str
    caption: str


def drawings_of(recording: Recording, decoding: Decoding, tracker: str, subject: str) -> tuple[Drawing, ...]:
    """All pictures of a decode; each one carries `subject`, so that it may be shown alone."""
    found = [_tracks(recording, tracker, subject)]
    rows = sum(item.channel.symbols for item in decoding.channels)
    found.append(_panel(draw_evidence, decoding, subject, rows, _evidence_caption(decoding)))
    if has_growth(decoding):
        caption = (
            "What each window adds, robot by robot: the log of its mean likelihood ratio over all symbols. This is "
            "before anything that was searched is paid for; the verdict rests on the evidence above, which is less."
        )
        found.append(_panel(draw_growth, decoding, subject, 6, caption))
    if decoding.verdict != "absent":
        caption = "Each row is a robot's part of the message, each column a symbol. What is not certain is not framed."
        found.append(_panel(draw_scores, decoding, subject, rows, caption))
    found.append(_panel(draw_timing, decoding, subject, len(decoding.channels), _timing_caption(decoding)))
    return tuple(found)


def _tracks(recording: Recording, tracker: str, subject: str) -> Drawing:
    still = still_of(recording, tracker)
    if still is None:
        figure = _figure(5.0, subject)
        draw_tracks(figure.subplots(), recording.tracks)
        return Drawing(_svg(figure), "Where the robots went: a disc at each start, a square at each end.")
    caption = (
        f"Where the robots went over the picture at {still.time_s:.2f} s: a disc at each start, a square at each end. "
        "Where the camera moved, its motion is taken out of the tracks and not out of the picture."
    )
    if still.mirrored:
        caption += " The film shows a mirror's image, so the picture is turned as its markers are read."
    region = region_of(tracker)
    return Drawing(
        _over_still(recording, still, region, subject), caption + (_region_caption(tracker) if region else "")
    )


def _region_caption(tracker: str) -> str:
    return f" Dashed: the region in which the tracker {tracker} looked."


def _over_still(recording: Recording, still: Still, region: tuple[int, int, int, int] | None, subject: str) -> str:
    width_px, height_px = still.size_px
    across_in = _WIDTH_IN - _LEFT_IN - _RIGHT_IN
    across_in = min(across_in, _MOST_DOWN_IN * width_px / height_px)
    down_in = across_in * height_px / width_px
    total_in, left_in = down_in + _BELOW_IN + _ABOVE_IN, (_WIDTH_IN + _LEFT_IN - _RIGHT_IN - across_in) / 2.0
    figure = Figure(figsize=(_WIDTH_IN, total_in))
    axes = figure.add_axes(
        (left_in / _WIDTH_IN, _BELOW_IN / total_in, across_in / _WIDTH_IN, down_in / total_in), facecolor="none"
    )
    axes.patch.set_gid(_STILL_ID)
    draw_tracks_over(axes, recording.tracks, still.size_px)
    if region is not None:
        left, upper, right, lower = region
        axes.add_patch(Rectangle((left, upper), right - left, lower - upper, fill=False, linestyle="--",
                                 edgecolor="#ffbf00", linewidth=1.5))  # fmt: skip
    figure.text(0.5, 0.1 / total_in, plain(subject), ha="center", fontsize=6.5, color=TEXT_COLOUR)
    box = (72.0 * left_in, 72.0 * _ABOVE_IN, 72.0 * across_in, 72.0 * down_in)
    return _with_still(_svg(figure), still, box)


def _with_still(svg: str, still: Still, box: tuple[float, float, float, float]) -> str:
    """The picture in the place of the empty patch behind the tracks: matplotlib itself embeds PNG, many times as large.

    `box` is left, upper edge, width and height in the drawing's units.
    """
    data = base64.b64encode(still.jpeg()).decode("ascii")
    left, upper, width, height = box
    image = (
        f'<image x="{left:.2f}" y="{upper:.2f}" width="{width:.2f}" height="{height:.2f}" preserveAspectRatio="none" '
        f'href="data:image/jpeg;base64,{data}"/>'
    )
    replaced, count = re.subn(rf'<g id="{_STILL_ID}">.*?</g>', lambda _: image, svg, count=1, flags=re.DOTALL)
    assert count == 1, "matplotlib drew no patch behind the tracks"
    return replaced


def _panel(
    draw: Callable[[Axes, Decoding], None], decoding: Decoding, subject: str, rows: int, caption: str
) -> Drawing:
    figure = _figure(min(max(_LEAST_HEIGHT_IN, _FURNITURE_IN + _ROW_IN * rows), _MOST_HEIGHT_IN), subject)
    draw(figure.subplots(), decoding)
    return Drawing(_svg(figure), caption)


def _figure(height_in: float, subject: str) -> Figure:
    figure = Figure(figsize=(_WIDTH_IN, height_in), layout=ConstrainedLayoutEngine(w_pad=0.1, h_pad=0.08))
    figure.supxlabel(plain(subject), fontsize=6.5, color=TEXT_COLOUR)
    return figure


def _svg(figure: Figure) -> str:
    """The `svg` element alone, without what only a file of its own needs."""
    FigureCanvasSVG(figure)
    text = io.StringIO()
    nothing = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    with rc_context({"svg.fonttype": "none"}), warnings.catch_warnings():
        # A browser has the letters that the font here lacks.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        figure.savefig(text, format="svg", transparent=True, metadata=nothing)
    svg = text.getvalue()
    return _UNUSED_ID.sub("", svg[svg.index("<svg") :])


def _evidence_caption(decoding: Decoding) -> str:
    if decoding.evidence.nats is None:
        return "How much this key finds beside keys that nobody holds, each searched for alike."
    if decoding.verdict == "absent":
        return "What the recording says for any message of this key. Nothing was read, so no symbol is shown."
    return "Bits of evidence beside what is needed. A robot that shows nothing is named with the reason."


def _timing_caption(decoding: Decoding) -> str:
    if decoding.verdict == "absent":
        return "Gaps in the shading are times out of sight."
    return (
        "Gaps in the shading are times out of sight. Boxes are windows with their place in the robot's part of the "
        "message, and red lines are where it begins."
    )
