"""One picture of a decode: where the robots went, what each symbol scored, and how much evidence there is."""

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import MaxNLocator

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.drawing.output import check_output_path
from mtm_audit.model.recording import Recording
from mtm_audit.model.track import Floats, Track
from mtm_audit.reporting.figure_file import save_figure
from mtm_audit.reporting.text import chance_sentence, verdict_sentence

SUFFIXES = (".png", ".pdf", ".svg")

_VERDICT_COLOURS = {"decoded": "#1a7f37", "absent": "#b42318", "inconclusive": "#b54708"}
_TRACK_COLOURS = ("#3366cc", "#dd7711", "#2a9d5c", "#b03a8c", "#7a5cc9", "#8a6d3b", "#0f8b8d", "#6b7280")
_KEY_COLOUR, _QUIET = "#1d3557", "#a9b4c2"
# More cells than this would be specks; numbers are written into fewer than the second count only.
_WRITTEN_CELLS = 48
_PLACES_NAMED = 24


def check_plot_path(path: Path) -> None:
    """Raise MtmError unless a picture can be written to `path`; meant for the time before the long work."""
    check_output_path(path, SUFFIXES)


def draw_plot(recording: Recording, decoding: Decoding, path: Path) -> None:
    """Draw the decode into `path`, whole or not at all; raises MtmError as `check_plot_path` does."""
    check_plot_path(path)
    figure = Figure(figsize=(11.0, 7.6), dpi=100, layout=ConstrainedLayoutEngine(w_pad=0.15, h_pad=0.12))
    FigureCanvasAgg(figure)
    colour = _VERDICT_COLOURS[decoding.verdict]
    figure.suptitle(verdict_sentence(decoding), fontsize=16, fontweight="bold", color=colour)
    figure.supxlabel(chance_sentence(decoding), fontsize=9, color="#475467")
    if decoding.verdict == "absent":
        # Scores of a recording without a message would be chance, and would look like symbols.
        tracks, evidence = figure.subplots(1, 2)
        _draw_tracks(tracks, recording.tracks)
        _draw_evidence(evidence, decoding)
    else:
        (tracks, scores), (evidence, margins) = figure.subplots(2, 2, height_ratios=(1.25, 1.0))
        _draw_tracks(tracks, recording.tracks)
        _draw_scores(scores, decoding)
        _draw_evidence(evidence, decoding)
        _draw_margins(margins, decoding)
    save_figure(figure, path, "mtm-audit decode")


def _draw_tracks(axes: Axes, tracks: tuple[Track, ...]) -> None:
    for number, track in enumerate(tracks):
        colour = _TRACK_COLOURS[number % len(_TRACK_COLOURS)]
        # Positions that were not observed are NaN, which breaks the line.
        x, y = track.positions[:, 0], track.positions[:, min(1, track.positions.shape[1] - 1)]
        axes.plot(x, y, color=colour, linewidth=1.6, label=track.name)
        seen = np.flatnonzero(track.valid)
        if len(seen):
            axes.plot(x[seen[0]], y[seen[0]], "o", color=colour, markersize=6)
            axes.plot(x[seen[-1]], y[seen[-1]], "s", color=colour, markersize=6, markerfacecolor="white")
    unit = tracks[0].unit
    axes.set(title="Where the robots went (● start, □ end)", xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(color="#e5e7eb", linewidth=0.8)
    axes.set_axisbelow(True)
    if len(tracks) <= len(_TRACK_COLOURS):
        _legend_below(axes)
    _tidy(axes)


def _draw_scores(axes: Axes, decoding: Decoding) -> None:
    names, table = _score_table(decoding)
    low, high = float(table.min()), float(table.max())
    low -= 0.1 * abs(low)
    image = axes.imshow(table, aspect="auto", cmap="Blues", vmin=low, vmax=high)
    axes.figure.colorbar(image, ax=axes, shrink=0.85, label="score")
    best = np.argmax(table, axis=1)
    if table.size <= _WRITTEN_CELLS:
        for (row, symbol), score in np.ndenumerate(table):
            colour = "white" if score > (low + high) / 2.0 else "#344054"
            axes.text(symbol, row, _written(float(score)), ha="center", va="center", fontsize=9, color=colour)
    axes.plot(best, np.arange(len(best)), "s", markersize=26 if len(best) <= 6 else 10, markerfacecolor="none",
              markeredgecolor="#e4572e", markeredgewidth=2.0)  # fmt: skip
    axes.set(title="What each symbol scored (best framed)", xlabel="symbol")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    _name_places(axes, names)


def _draw_decoys(axes: Axes, decoding: Decoding) -> None:
    decoys = decoding.evidence.decoys
    if decoys is None:
        return
    axes.hist(decoys.decoy_strengths, bins="auto", color=_QUIET, edgecolor="#8593a6", linewidth=0.6, label="decoy keys")
    axes.axvline(decoys.strength, color=_VERDICT_COLOURS[decoding.verdict], linewidth=3.0, label="this key")
    axes.set(title="This key against keys that nobody holds", xlabel="strength of the best message", ylabel="keys")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    _legend_below(axes)
    _tidy(axes)


def _draw_evidence(axes: Axes, decoding: Decoding) -> None:
    if decoding.evidence.nats is not None:
        _draw_bits(axes, decoding)
    else:
        _draw_decoys(axes, decoding)


def _draw_bits(axes: Axes, decoding: Decoding) -> None:
    """Evidence of each symbol beside what it needs; without a message no bar is drawn that could look like one."""
    needed = decoding.needed_nats / math.log(2.0)
    names, bits = _symbol_bits(decoding)
    rows = np.arange(len(names))
    if decoding.verdict == "absent":
        axes.text(0.5, 0.5, "no evidence of a message of this key", ha="center", va="center", color="#475467",
                  transform=axes.transAxes)  # fmt: skip
        bits = np.zeros(len(names))
    colours = [_KEY_COLOUR if value >= needed else _QUIET for value in bits]
    axes.barh(rows, bits, color=colours, height=0.62)
    axes.axvline(needed, color=_VERDICT_COLOURS[decoding.verdict], linewidth=2.0, label=f"needed: {needed:.1f} bits")
    axes.set(title="Evidence for each symbol", xlabel="bits")
    axes.set_xlim(min(0.0, float(bits.min(initial=0.0))), 1.15 * max(needed, float(bits.max(initial=0.0))))
    axes.invert_yaxis()
    _legend_below(axes)
    _name_places(axes, names)
    _tidy(axes)


def _symbol_bits(decoding: Decoding) -> tuple[list[str], Floats]:
    """Places of the message by name and their bits of evidence; channels where a frame has a check of its own."""
    if decoding.scheme.framing is not None:
        channels = [(item.channel.name, item.nats) for item in decoding.channels]
        return [name for name, _ in channels], np.array([(nats or 0.0) / math.log(2.0) for _, nats in channels])
    names = []
    for channel in decoding.scheme.channels[: 1 if decoding.scheme.combine == "same" else None]:
        count = channel.symbols
        names += [channel.name if count == 1 else f"{channel.name}.{place}" for place in range(count)]
    return names, np.array([(nats or 0.0) / math.log(2.0) for nats in decoding.symbol_nats])


def _draw_margins(axes: Axes, decoding: Decoding) -> None:
    names, table = _score_table(decoding)
    ranked = np.sort(table, axis=1)
    rows = np.arange(len(names))
    axes.barh(rows, ranked[:, -1], color=_KEY_COLOUR, height=0.62, label="best symbol")
    axes.barh(rows, ranked[:, -2], color=_QUIET, height=0.62, label="second best")
    if len(names) <= _PLACES_NAMED:
        for row, (second, first) in enumerate(ranked[:, -2:]):
            axes.text(first, row, f" +{_written(first - second)}", va="center", fontsize=9, color="#344054")
    axes.set(title="How far the best symbol is ahead", xlabel="score")
    axes.margins(x=0.15)
    axes.invert_yaxis()
    _legend_below(axes)
    _name_places(axes, names)
    _tidy(axes)


def _score_table(decoding: Decoding) -> tuple[list[str], Floats]:
    """One row a channel and position that was read, with its name; M columns."""
    names: list[str] = []
    rows = []
    for channel in decoding.channels:
        if channel.reading is not None:
            count = channel.channel.symbols
            names += [channel.channel.name if count == 1 else f"{channel.channel.name}.{n}" for n in range(count)]
            rows.append(channel.reading.scores)
    return names, np.concatenate(rows)


def _written(score: float) -> str:
    """Coherencies lie below one, log-likelihood ratios in the hundreds."""
    return f"{score:.2f}" if abs(score) < 10.0 else f"{score:.0f}"


def _name_places(axes: Axes, names: list[str]) -> None:
    if len(names) <= _PLACES_NAMED:
        axes.set_yticks(range(len(names)), names, fontsize=9)
    else:
        axes.set_ylabel("place in the message")


def _legend_below(axes: Axes) -> None:
    axes.legend(fontsize=9, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=4, frameon=False)


def _tidy(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)
