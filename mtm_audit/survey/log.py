"""Looking through logs and motion capture without a key."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mtm_audit.model.track import Track
from mtm_audit.readers.logs.choosing import SeveralPosesError
from mtm_audit.readers.logs.opening import opening_of
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.registry import format_of, read_log
from mtm_audit.survey.timeline import Timeline, timeline_of
from mtm_onboard.protocol.errors import MtmError

_MOST_TOPICS = 12  # that are read to tell what is in them


@dataclass(frozen=True, kw_only=True)
class Body:
    """One body of a log: when it was observed, in which unit and axes, and how far it went along the widest axis.

    `seen` and `headings` are the shares of its rows with a position and with a heading, which is that of the body's
    `heading_axis` where it is turned in three dimensions.
    """

    name: str
    timeline: Timeline
    unit: str
    axes: tuple[str, ...]
    seen: float
    headings: float
    heading_axis: str | None
    travel: float


@dataclass(frozen=True, kw_only=True)
class Topic:
    """A part of a log that has to be asked for: its bodies, or why it cannot be read; neither when not looked at."""

    name: str
    bodies: tuple[Body, ...] = ()
    refusal: str | None = None


@dataclass(frozen=True, kw_only=True)
class LogSurvey:
    """What is in one file: its format in words, None for text that is read as a table of numbers.

    `bodies` are what is read as it stands; `topics` are there when one of several has to be named. `begun_unix_s` is
    when its clock stood at zero, where it tells.
    """

    path: Path
    format: str | None
    bodies: tuple[Body, ...]
    topics: tuple[Topic, ...]
    begun_unix_s: float | None
    warnings: tuple[str, ...]


def survey_log(
    path: Path, options: ReadOptions | None = None, progress: Callable[[str], None] | None = None
) -> LogSurvey:
    """Read one log; of one with several poses each in turn. Raises MtmError as `read_log` does otherwise."""
    asked = options or ReadOptions()
    found = format_of(opening_of(path))
    warnings: list[str] = []
    bodies: tuple[Body, ...] = ()
    topics: tuple[Topic, ...] = ()
    begun_unix_s = None
    try:
        log = read_log(path, asked, warnings.append)
        bodies = tuple(map(_body, log.tracks))
        begun_unix_s = None if log.at is None else log.at.unix_s
    except SeveralPosesError as refusal:
        topics = _topics(path, asked, refusal.offered, progress or (lambda name: None))
    return LogSurvey(
        path=path,
        format=None if found is None else found.name,
        bodies=bodies,
        topics=topics,
        begun_unix_s=begun_unix_s,
        warnings=tuple(dict.fromkeys(warnings)),
    )


def _topics(
    path: Path, asked: ReadOptions, offered: Sequence[str], progress: Callable[[str], None]
) -> tuple[Topic, ...]:
    names = list(dict.fromkeys(offered))
    read = []
    for name in names[:_MOST_TOPICS]:
        progress(name)
        try:
            log = read_log(path, replace(asked, topics=(name,)))
            read.append(Topic(name=name, bodies=tuple(map(_body, log.tracks))))
        except MtmError as refusal:
            read.append(Topic(name=name, refusal=str(refusal)))
    return (*read, *(Topic(name=name) for name in names[_MOST_TOPICS:]))


def _body(track: Track) -> Body:
    seen = track.positions[track.valid]
    headings = track.headings_rad
    return Body(
        name=track.name,
        timeline=timeline_of(track.times_s),
        unit=track.unit,
        axes=track.axes,
        seen=float(np.mean(track.valid)),
        headings=0.0 if headings is None else float(np.mean(np.isfinite(headings))),
        heading_axis=track.heading_axis,
        travel=float(np.ptp(seen, axis=0).max()) if len(seen) else 0.0,
    )
