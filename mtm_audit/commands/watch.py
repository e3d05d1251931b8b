"""`mtm-audit watch`: a source while it lasts, up to the verdict."""

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from mtm_audit.commands.console import answer_console
from mtm_audit.commands.decode import EXIT_CODES
from mtm_audit.commands.opened_key import KeySource, OpenedKey, opened_key
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.live.events import Pose
from mtm_audit.live.feed import Feed
from mtm_audit.live.judges import JudgeBeside
from mtm_audit.live.judging import Judged
from mtm_audit.live.record import FilmRecord, PoseRecord, new_folder
from mtm_audit.live.sources import Source, source_of
from mtm_audit.live.state import WatchState
from mtm_audit.live.terminal import Board
from mtm_audit.live.watching import Film, Gathering, Poses, Watch
from mtm_audit.model.lens import Lens
from mtm_audit.model.picture import Frame
from mtm_audit.model.recording import Kind, Recording
from mtm_audit.reporting.remarks import remarks
from mtm_audit.reporting.text import print_report, verdict_sentence
from mtm_audit.tracking.following import following
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.installing import missing_sentence

if TYPE_CHECKING:
    from mtm_audit.live.page import Page


@dataclass(frozen=True, kw_only=True)
class WatchOptions:
    """What the command line asked for; `page` is a port, 0 for any, None for no page; `seconds` None for no end.

    `at_unix_s` is when the first thing was seen, give or take `at_error_s`; None takes now for a live source. `lens` is
    that of a camera's pictures.
    """

    source: str
    key: KeySource
    tracker: str
    reference: tuple[str, ...]
    settings: DecodeSettings
    at_unix_s: float | None
    at_error_s: float
    seconds: float | None
    page: int | None
    record: Path | None
    lens: Lens | None = None


@dataclass
class _Show:
    """Passes on what the watch tells: to the state, to the record of poses, and notices to who has no terminal."""

    state: WatchState
    film: Film | None
    record: PoseRecord | None
    is_plain: bool

    def shown(self, event: Frame | Pose, watched_s: float) -> None:
        if isinstance(event, Pose) and self.record is not None:
            self.record.put(event)
        self.state.shown(event, watched_s, None if self.film is None else self.film.following.latest())

    def noticed(self, sentence: str) -> None:
        self.state.noticed(sentence)
        if self.is_plain:
            print(f"mtm-audit: {sentence}", file=sys.stderr, flush=True)

    def judged(self, judged: Judged) -> None:
        self.state.judged(judged)


def run_watch(options: WatchOptions) -> int:
    """Watch and report; returns the exit code, that of decode. Raises MtmError when nothing can be watched."""
    opened = opened_key(options.key, options.settings.revoked)
    source = source_of(options.source)
    served = None if options.page is None else _page_class()
    film = Film(following(options.tracker), options.reference, options.lens) if source.is_film else None
    gathering: Gathering = film or Poses()
    wall = _wall(options, source, opened)
    state = WatchState(source.shown, opened.key, options.settings.threshold)
    console = Console(stderr=True)
    with ExitStack() as stack:
        folder = None if options.record is None else new_folder(options.record)
        film_record = stack.enter_context(FilmRecord(folder)) if folder and source.is_film else None
        pose_record = stack.enter_context(PoseRecord(folder)) if folder and not source.is_film else None
        judge = JudgeBeside(opened.key, options.settings)
        stack.callback(judge.close)
        page = None
        if served is not None:
            page = stack.enter_context(served(state, options.page or 0))
            print(f"mtm-audit: the page is {page.url}", file=sys.stderr, flush=True)
        feed = Feed(source.events(film.following.pixels if film else "gray", film_record), is_live=source.is_live)
        stack.callback(feed.stop)
        show = _Show(state, film, pose_record, is_plain=not console.is_terminal)
        watch = Watch(
            opened.key.scheme, gathering, judge, show, waits=not source.is_live, most_s=options.seconds,
            wall=wall, wall_error_s=options.at_error_s,
        )  # fmt: skip
        with Board(state, console, None if page is None else page.url), _until_interrupted(show):
            watch.run(feed)
        answer = _answer(watch, opened)
        state.finished(answer, decoded=watch.is_decided)
        text, code = _report(watch, opened, source, answer)
        sys.stdout.write(text)
        sys.stdout.flush()
        if page is not None:
            page.let_it_be_seen()
    return code


def _page_class() -> type["Page"]:
    """What serves the page; raises MtmError when the library for it is not installed."""
    try:
        from mtm_audit.live.page import Page
    except ModuleNotFoundError as error:
        raise MtmError(missing_sentence(error, "--page", "live")) from error
    return Page


@contextmanager
def _until_interrupted(show: _Show) -> Iterator[None]:
    """An interrupt ends the watch and not the program."""
    try:
        yield
    except KeyboardInterrupt:
        show.noticed("interrupted; this is the best answer so far")


def _wall(options: WatchOptions, source: Source, opened: OpenedKey) -> Callable[[], float] | None:
    """What tells the time of day of the first thing seen: what was said, or of a live source this machine's clock.

    None where nobody says so. Raises MtmError when that is needed.
    """
    begun_s = options.at_unix_s
    if begun_s is not None:
        return lambda: begun_s
    if source.is_live:
        return time.time
    if opened.key.scheme.schedule == "rolling":
        raise MtmError(
            "this key's schedule is rolling, so that its waveforms follow the clock; say when the file was begun with "
            "--at"
        )
    return None


def _answer(watch: Watch, opened: OpenedKey) -> str:
    """The verdict in one line; raises MtmError when nothing could be read in all the time."""
    if watch.best is not None and watch.best.decoding is not None:
        return verdict_sentence(watch.best.decoding)
    if watch.last is None:
        needed_s = watch.first_look_s
        raise MtmError(
            f"only {watch.watched_s:.1f} s were watched, and the first look is at {needed_s:.1f} s; watch longer"
        )
    if watch.last.refusal is not None:
        raise MtmError(watch.last.refusal)
    return f"absent: no message of key {opened.key.id} was found so far"


def _report(watch: Watch, opened: OpenedKey, source: Source, answer: str) -> tuple[str, int]:
    """What is printed at the end, and the exit code."""
    best = watch.best
    if best is None or best.decoding is None:
        glances = f"watched for {watch.watched_s:.1f} s; a glance at each look showed too little to weigh"
        return f"{answer}\n{glances}\n", EXIT_CODES["absent"]
    decoding: Decoding = best.decoding
    kind: Kind = "video" if source.is_film else "motion capture"
    recording = Recording((Path(source.shown),), kind, best.tracks, best.warnings, watch.at)
    basis = opened.basis(recording, decoding, None, stated=True)
    console = answer_console()
    with console.capture() as captured:
        print_report(console, recording, decoding, (*remarks(recording, decoding), *opened.warnings), basis)
    return captured.get() + _looks_sentence(watch, best) + "\n", EXIT_CODES[decoding.verdict]


def _looks_sentence(watch: Watch, best: Judged) -> str:
    """Which look this is, and what looking more than once costs."""
    which = "the look at the end" if best.look.number == 0 else f"look {best.look.number}"
    at = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S")
    return (
        f"This is what {which} saw, at {best.look.until_s:.1f} s of {watch.watched_s:.1f} s watched up to {at} UTC; "
        f"looking again and again is paid for with {math.log2(best.look.choices):.1f} bits."
    )
