"""Watching: what a source shows is gathered, looked at when it is time, and left at the verdict."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Protocol

from mtm_audit.decoding.paid import worth
from mtm_audit.decoding.pieces import part_of_track, piece_length_s
from mtm_audit.live.events import Event, Notice, Pose, Quiet
from mtm_audit.live.judges import Judge
from mtm_audit.live.judging import Judged, Seen
from mtm_audit.live.looks import Look, Looks, final_look
from mtm_audit.live.poses import PoseTracks
from mtm_audit.model.lens import Lens
from mtm_audit.model.picture import Frame
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.tracking.background import BackgroundFollower
from mtm_audit.tracking.following import Following
from mtm_audit.tracking.lens import check_fits
from mtm_onboard.protocol.scheme import Scheme

# How much more than is looked at may be kept, before what is too old is dropped.
_SPARE = 0.2


class Gathering(Protocol):
    """What a watch keeps of what it was shown."""

    def put(self, event: Frame | Pose) -> None:
        """Take in the next frame or pose."""
        ...

    def seen(self, begin_s: float, end_s: float) -> Seen:
        """What was seen between the two instants."""
        ...

    def forget(self, before_s: float) -> None:
        """Drop what was seen before then."""
        ...


@dataclass
class Poses:
    """Gathers poses."""

    inner: PoseTracks = field(default_factory=PoseTracks)

    def put(self, event: Frame | Pose) -> None:
        """Take in a pose."""
        assert isinstance(event, Pose)
        self.inner.put(event)

    def seen(self, begin_s: float, end_s: float) -> Seen:
        """The tracks."""
        cut = (part_of_track(track, begin_s, end_s) for track in self.inner.tracks())
        return Seen(tuple(track for track in cut if len(track.times_s)))

    def forget(self, before_s: float) -> None:
        """Drop what was seen before then."""
        self.inner.forget(before_s)


@dataclass
class Film:
    """Gathers what is tracked in frames, and what stands still behind it."""

    following: Following
    reference: tuple[str, ...] = ()
    lens: Lens | None = None
    background: BackgroundFollower = field(init=False)

    def __post_init__(self) -> None:
        self.background = BackgroundFollower(is_needed=not self.reference)

    def put(self, event: Frame | Pose) -> None:
        """Track in the next frame; raises MtmError when the size of the picture changes, or is not the lens'."""
        assert isinstance(event, Frame)
        if self.lens is not None:
            check_fits(event, self.lens)
        self.following.look(event)
        self.background.look(event)

    def seen(self, begin_s: float, end_s: float) -> Seen:
        """The tracks, and the background that goes with them frame by frame."""
        self.forget(begin_s)
        tracks = tuple(part_of_track(track, begin_s, end_s) for track in self.following.tracks())
        return Seen(tracks, self.background.until(end_s), self.following.flipped, self.reference, lens=self.lens)

    def forget(self, before_s: float) -> None:
        """Drop what was seen before then."""
        self.following.forget(before_s)
        self.background.forget(before_s)


class Audience(Protocol):
    """Who is told while it happens."""

    def shown(self, event: Frame | Pose, watched_s: float) -> None:
        """Something was seen; the watch has lasted so long."""
        ...

    def noticed(self, sentence: str) -> None:
        """Something happened that a person should know."""
        ...

    def judged(self, judged: Judged) -> None:
        """A look was finished."""
        ...


@dataclass
class Watch:
    """One watch. `best` is the look that shows most so far, `last` the newest that was finished.

    With `waits` nothing is taken in while a look is judged: for files, which lose nothing by waiting, and whose verdict
    then does not depend on how fast the machine is. `most_s` ends the watch after so long, None at the verdict alone.
    `wall` tells the time of day in seconds since the Unix epoch, give or take `wall_error_s`, by which a rolling
    schedule is read; None where the judge knows when the watch was begun.
    """

    scheme: Scheme
    gathering: Gathering
    judge: Judge
    audience: Audience
    waits: bool = False
    most_s: float | None = None
    wall: Callable[[], float] | None = None
    wall_error_s: float = 0.0
    at: RecordedAt | None = None
    best: Judged | None = None
    last: Judged | None = None
    watched_s: float = 0.0
    _begin_s: float | None = None
    _looks: Looks = field(init=False)

    def __post_init__(self) -> None:
        self._looks = Looks(self.scheme)
        self._longest_s = piece_length_s(self.scheme)
        self._kept_from_s = 0.0
        self._is_told = False

    def run(self, events: Iterable[Event]) -> None:
        """Watch until a message is decoded, the source ends or the time is over; raises MtmError as the source does."""
        for event in events:
            if isinstance(event, Notice):
                self.audience.noticed(event.sentence)
            elif not isinstance(event, Quiet) and self._is_over(event):
                break
            elif not isinstance(event, Quiet):
                self._take(event)
            self._collect()
            if self.is_decided:
                return
            self._look_when_due()
            if self.is_decided:
                return
        self._look_at_the_end()

    @property
    def is_decided(self) -> bool:
        """Whether a message was decoded."""
        return self.best is not None and self.best.decoding is not None and self.best.decoding.verdict == "decoded"

    @property
    def first_look_s(self) -> float:
        """When the first look is due."""
        return Looks(self.scheme).next_s

    def _is_over(self, event: Frame | Pose) -> bool:
        if self._begin_s is None:
            self._begin_s = event.time_s
            if self.wall is not None:
                self.at = RecordedAt(self.wall() - event.time_s, self.wall_error_s)
        return self.most_s is not None and event.time_s - self._begin_s >= self.most_s

    def _take(self, event: Frame | Pose) -> None:
        assert self._begin_s is not None
        self.gathering.put(event)
        self.watched_s = max(self.watched_s, event.time_s - self._begin_s)
        self.audience.shown(event, self.watched_s)
        if self.watched_s - self._kept_from_s > (1.0 + _SPARE) * self._longest_s:
            self._kept_from_s = self.watched_s - self._longest_s
            self.gathering.forget(self._begin_s + self._kept_from_s)

    def _collect(self) -> None:
        """Take what the judge has finished."""
        judged = self.judge.finished()
        if judged is None:
            return
        self.last = judged
        self.audience.judged(judged)
        found, best = judged.decoding, None if self.best is None else self.best.decoding
        if found is not None and (best is None or worth(found) >= worth(best)):
            self.best = judged

    def _look_when_due(self) -> None:
        if self.waits:
            self.judge.wait()
            self._collect()
        if not self.judge.is_busy and (due := self._looks.due(self.watched_s)) is not None:
            self._begin_look(due)

    def _begin_look(self, look: Look) -> None:
        begin_s = max(0.0, look.until_s - self._longest_s)
        if begin_s > 0.0 and not self._is_told:
            self._is_told = True
            self.audience.noticed(f"the watch is long; each look is at its last {self._longest_s / 60.0:g} minutes")
        assert self._begin_s is not None
        seen = self.gathering.seen(self._begin_s + begin_s, self._begin_s + look.until_s)
        self.judge.begin(look, replace(seen, at=self.at))
        if self.waits:
            self.judge.wait()
        self._collect()

    def _look_at_the_end(self) -> None:
        """The look at all that the source showed."""
        if self._begin_s is None:
            return
        while self.judge.is_busy:
            self.judge.wait()
            self._collect()
        if self.is_decided:
            return
        # The end itself is seen as well.
        end_s = self.watched_s + 1e-6 if self.most_s is None else max(self.watched_s + 1e-6, self.most_s)
        self._begin_look(final_look(end_s))
        while self.judge.is_busy:
            self.judge.wait()
            self._collect()
