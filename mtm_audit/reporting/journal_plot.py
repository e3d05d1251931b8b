"""A journal as a picture: base and sent commands over time, and how late the ticks were."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from mtm_audit.reporting.figure_file import save_figure
from mtm_audit.reporting.journal_summary import AXES
from mtm_audit.reporting.panels.style import TEXT_COLOUR, plain
from mtm_audit.reporting.plot import check_plot_path
from mtm_audit.reporting.subject import dated, now
from mtm_onboard.protocol.journal_file import JournalHeader, JournalRecord

_UNITS = ("m/s", "m/s", "rad/s")
# More than a picture has columns; of a longer run every k-th tick is drawn.
_MOST_POINTS = 20_000


def draw_journal(record: JournalRecord, journal: Path, path: Path) -> None:
    """Draw what the file `journal` says into `path`, whole or not at all.

    Raises MtmError when no picture can be written there.
    """
    check_plot_path(path)
    figure = Figure(figsize=(11.0, 8.5), dpi=100, layout=ConstrainedLayoutEngine(w_pad=0.15, h_pad=0.1))
    FigureCanvasAgg(figure)
    figure.suptitle(f"{plain(record.header.robot)}: what was commanded", fontsize=15, fontweight="bold")
    figure.supxlabel(plain(_subject(record.header, journal)), fontsize=9, color=TEXT_COLOUR)
    *commands, lateness = figure.subplots(4, 1)
    every = max(1, len(record.ticks) // _MOST_POINTS)
    times_s = record.ticks[::every] / record.header.rate_hz
    for column, (axes, name, unit) in enumerate(zip(commands, AXES, _UNITS, strict=True)):
        axes.plot(times_s, record.sent[::every, column], color="#e4572e", linewidth=0.8, label="sent")
        axes.plot(times_s, record.base[::every, column], color="#1d3557", linewidth=1.2, label="base")
        axes.set(ylabel=f"{name} [{unit}]")
        axes.sharex(commands[0])
        axes.grid(color="#e5e7eb", linewidth=0.8)
        axes.spines[["top", "right"]].set_visible(False)
        for event in record.events:
            axes.axvline(event.tick / record.header.rate_hz, color="#b54708", linewidth=1.0, linestyle=":")
    thinned = "" if every == 1 else f" (every {every}th tick)"
    commands[-1].set_xlabel(f"seconds since the message's start{thinned}; dotted: events")
    commands[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False, fontsize=9)
    late_ms = np.maximum(1e3 * record.lateness_s, 1e-3)
    bins = np.geomspace(late_ms.min() * 0.99, max(late_ms.max(), 1e-2) * 1.01, 60)
    lateness.hist(late_ms, bins=bins.tolist(), color="#a9b4c2", edgecolor="#8593a6", linewidth=0.6)
    lateness.set(xscale="log", yscale="log", xlabel="lateness of a tick [ms]", ylabel="ticks")
    lateness.set_ylim(bottom=0.5)
    lateness.spines[["top", "right"]].set_visible(False)
    save_figure(figure, path, "mtm-audit journal")


def _subject(header: JournalHeader, journal: Path) -> str:
    """Journal, key and dates in one line."""
    started = "in simulated time"
    if header.start_unix_s is not None:
        started = f"started {datetime.fromtimestamp(header.start_unix_s, UTC):%Y-%m-%d %H:%M:%S} UTC"
    key = f"key {header.key_id} (scheme {header.fingerprint})"
    return " · ".join([f"journal {journal.name}", key, started, f"drawn {dated(now())}"])
