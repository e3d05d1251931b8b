"""The watch in a terminal."""

from collections.abc import Mapping

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from mtm_audit.live.state import Snapshot, WatchState

_BAR = 30
_RISING = " ▁▂▃▄▅▆▇█"
_REFRESHED_HZ = 4.0


class Board:
    """Shows a state again and again; a context manager, and nothing where nobody sees it."""

    def __init__(self, state: WatchState, console: Console, page: str | None = None) -> None:
        self._state, self._page = state, page
        self._live = Live(
            get_renderable=self._now, console=console, refresh_per_second=_REFRESHED_HZ, transient=True,
            redirect_stdout=False, redirect_stderr=False,
        )  # fmt: skip
        self._is_shown = console.is_terminal

    def __enter__(self) -> "Board":
        if self._is_shown:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_shown:
            self._live.stop()

    def _now(self) -> RenderableType:
        return board(self._state.snapshot(), self._page)


def board(snapshot: Snapshot, page: str | None = None) -> RenderableType:
    """What is known now: how long it was watched, the evidence of each channel and of all, and what happened."""
    lines = [
        Text(f"watching {snapshot.source} for key {snapshot.key_id}: {snapshot.watched_s:.0f} s"),
        Text(f"{snapshot.answer}; {snapshot.looks} looks, the last {snapshot.last_look}"),
    ]
    if page is not None:
        lines.append(Text(page))
    return Group(*lines, _evidence(snapshot), *(Text(f"note: {text}", style="yellow") for text in snapshot.notices))


def _evidence(snapshot: Snapshot) -> Table:
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, header_style="bold")
    for name in ("channel", "bits", "", "over time"):
        table.add_column(name, justify="right" if name == "bits" else "left", no_wrap=True)
    newest: Mapping[str, float] = snapshot.points[-1].channels if snapshot.points else {}
    most = max([snapshot.needed_bits, *newest.values(), *(point.bits for point in snapshot.points)])
    for name in snapshot.channels:
        past = [point.channels.get(name, 0.0) for point in snapshot.points]
        table.add_row(Text(name), _number(newest.get(name)), _bar(newest.get(name, 0.0), most), _curve(past, most))
    bits = snapshot.points[-1].bits if snapshot.points else None
    past = [point.bits for point in snapshot.points]
    needed = f"together, {snapshot.needed_bits:.1f} needed"
    table.add_row(needed, _number(bits), _bar(bits or 0.0, most), _curve(past, most))
    return table


def _number(bits: float | None) -> str:
    return "-" if bits is None else f"{bits:.1f}"


def _bar(bits: float, most: float) -> str:
    return "█" * round(_BAR * min(max(bits, 0.0) / most, 1.0))


def _curve(bits: list[float], most: float) -> str:
    steps = len(_RISING) - 1
    return "".join(_RISING[round(steps * min(max(value, 0.0) / most, 1.0))] for value in bits[-_BAR:])
