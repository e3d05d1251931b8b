"""`mtm-audit journal`: what a robot's journal says about a run."""

import json
import sys
from datetime import UTC, datetime
from pathlib import Path

from rich.table import Table

from mtm_audit.commands.console import answer_console
from mtm_audit.reporting.journal_summary import AXES, JournalSummary, summary_of
from mtm_onboard.protocol.journal_file import JournalHeader, read_journal
from mtm_onboard.protocol.journal_noise import with_noise
from mtm_onboard.protocol.key import load_key
from mtm_onboard.protocol.output_file import check_outputs


def run_journal(path: Path, *, as_json: bool, plot: Path | None, key: Path | None = None, force: bool = False) -> None:
    """Read, draw, print, with the noise that the key makes again.

    Raises MtmError when there is no journal, no tick in it, another key's, or no picture can be written.
    """
    check_outputs("mtm-audit journal", plot, force=force)
    if plot is not None:
        from mtm_audit.reporting.plot import check_plot_path

        check_plot_path(plot)
    record = read_journal(path)
    if key is not None:
        record = with_noise(record, load_key(key))
    summary = summary_of(record)
    if plot is not None:
        from mtm_audit.reporting.journal_plot import draw_journal

        draw_journal(record, path, plot)
    if as_json:
        sys.stdout.write(json.dumps(summary.as_table(), indent=2, allow_nan=False) + "\n")
    else:
        console = answer_console()
        console.print(_table(summary), highlight=False)


def _table(summary: JournalSummary) -> Table:
    header = summary.header
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column(overflow="fold")
    late_ms = [f"{1e3 * value:.3f}" for value in summary.lateness_s]
    units = ("m", "m", "rad")
    rows = {
        "robot": f"{header.robot}, channel {header.channel}",
        "key": f"{header.key_id}, scheme {header.fingerprint}",
        "message": _message(header),
        "started": _start(header),
        "ticks": f"{summary.ticks} at {header.rate_hz:g} Hz, from {summary.first_tick} to {summary.last_tick}, "
        f"{summary.missed} missed",
        "of them": ", ".join(f"{count} {name}" for name, count in summary.counts.items()),
        "lateness": f"median {late_ms[0]} ms, p99 {late_ms[1]} ms, greatest {late_ms[2]} ms",
        "saturation": f"{100.0 * summary.saturation:.2f} % of ticks cut by a limit",
        "noise": "left out of the journal; give --key, which makes it again"
        if summary.rms is None or summary.energy is None
        else ", ".join(
            f"{axis} {rms:.4f} {unit}/s rms, energy {energy:.4g} {unit}\u00b2/s"
            for axis, unit, rms, energy in zip(AXES, units, summary.rms, summary.energy, strict=True)
        ),
    }
    if summary.damaged:
        rows["damaged"] = f"{summary.damaged} lines that could not be read"
    for name, text in rows.items():
        table.add_row(name, text)
    for event in summary.events:
        table.add_row(f"tick {event.tick}", event.text)
    return table


def _message(header: JournalHeader) -> str:
    if header.symbols is None:
        return "none at first"
    return f"symbols {','.join(map(str, header.symbols))}, {'repeated' if header.repeat else 'once'}"


def _start(header: JournalHeader) -> str:
    if header.start_unix_s is None:
        return "in simulated time"
    return f"{header.start_unix_s:.6f} s (Unix time), {datetime.fromtimestamp(header.start_unix_s, UTC):%F %T} UTC"
