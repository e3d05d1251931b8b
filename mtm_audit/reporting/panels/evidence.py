"""How much evidence there is: e-values in bits beside what is needed, or the key beside its decoys."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.reporting.panels.rows import evidence_rows
from mtm_audit.reporting.panels.style import (
    KEY_COLOUR,
    PLACES_NAMED,
    QUIET,
    VERDICT_COLOURS,
    legend_below,
    name_rows,
    plain,
    tidy,
)

# A label that crosses the line of what is needed must be read, and so must the line.
_LABEL = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 0.5}


def draw_evidence(axes: Axes, decoding: Decoding) -> None:
    """Bits where the detector gives exact evidence, else strengths."""
    if decoding.evidence.nats is not None:
        _draw_bits(axes, decoding)
    else:
        _draw_decoys(axes, decoding)


def _draw_bits(axes: Axes, decoding: Decoding) -> None:
    """A bar for each symbol, or for each channel of a frame; without a message only what there is for any message."""
    names, notes, bits = evidence_rows(decoding)
    by_symbol = decoding.verdict != "absent" and decoding.scheme.framing is None
    needed = (decoding.needed_nats if by_symbol else -math.log(decoding.settings.threshold)) / math.log(2.0)
    shown = np.nan_to_num(bits)
    colours = [KEY_COLOUR if value >= needed else QUIET for value in shown]
    rows = np.arange(len(names))
    axes.barh(rows, shown, color=colours, height=0.62)
    what = "needed" if by_symbol or decoding.verdict == "absent" else "needed by all together"
    axes.axvline(needed, color=VERDICT_COLOURS[decoding.verdict], linewidth=2.0, label=f"{what}: {needed:.1f} bits")
    low, high = min(0.0, float(shown.min())), max(needed, float(shown.max()))
    axes.set_xlim(1.15 * low, low + 1.15 * (high - low))
    if len(names) <= PLACES_NAMED:
        for row, (note, value) in enumerate(zip(notes, bits, strict=True)):
            amount = "" if math.isnan(value) else f"{value:.1f}"
            told = ", ".join(part for part in (amount, note) if part)
            # Inside a long bar there is room for more than beside it.
            inside = bool(np.isfinite(value)) and value > low + 0.6 * (high - low)
            axes.annotate(
                plain(told), (max(shown[row], 0.0), row), xytext=(-4 if inside else 4, 0), textcoords="offset points",
                va="center", ha="right" if inside else "left", fontsize=9, color="white" if inside else "#344054",
                bbox=None if inside or not told else _LABEL,
            )  # fmt: skip
    axes.set(title=_title(decoding), xlabel=_told_below(names, notes))
    axes.set_ylim(max(len(names), 3) - 0.5, -0.5)
    legend_below(axes)
    name_rows(axes, names)
    tidy(axes)


def _title(decoding: Decoding) -> str:
    if decoding.verdict == "absent":
        return "Evidence for any message of this key"
    return "Evidence for each symbol" if decoding.scheme.framing is None else "Evidence of each channel"


def _told_below(names: list[str], notes: list[str]) -> str:
    """Where rows are too many for names, name those that something is to be said of."""
    told = [f"{name} {note}" for name, note in zip(names, notes, strict=True) if note]
    return f"bits\n{plain('; '.join(told[:6]))}" if len(names) > PLACES_NAMED and told else "bits"


def _draw_decoys(axes: Axes, decoding: Decoding) -> None:
    decoys = decoding.evidence.decoys
    if decoys is None:
        return
    axes.hist(decoys.decoy_strengths, bins="auto", color=QUIET, edgecolor="#8593a6", linewidth=0.6, label="decoy keys")
    axes.axvline(decoys.strength, color=VERDICT_COLOURS[decoding.verdict], linewidth=3.0, label="this key")
    axes.set(title="This key against keys that nobody holds", xlabel="strength of the best message", ylabel="keys")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    legend_below(axes)
    tidy(axes)
