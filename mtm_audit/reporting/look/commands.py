"""Command lines that would decode what was looked at."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from mtm_audit.survey.film import FilmSurvey
from mtm_audit.survey.log import LogSurvey, Topic
from mtm_audit.tracking.dictionaries import USUAL

# What the pages call the key file everywhere.
_KEY = "robot.key"
_USUAL_TRACKER = f"aruco:{USUAL}"
_MOST_TOPICS = 3


def film_commands(survey: FilmSurvey, paths: Sequence[Path], frame_rate_hz: float | None) -> tuple[str, ...]:
    """One command line for each tracker that suits, the best first; `paths` are what the person named."""
    lines = []
    for name in survey.trackers:
        tracker = () if name == _USUAL_TRACKER else ("--tracker", name)
        reference = (
            ("--reference", ",".join(survey.reference)) if survey.reference and name == survey.trackers[0] else ()
        )
        rate = () if frame_rate_hz is None else ("--frame-rate", f"{frame_rate_hz:g}")
        lines.append(_line(paths, *tracker, *reference, *rate))
    return tuple(lines)


def log_commands(surveys: Sequence[LogSurvey], paths: Sequence[Path]) -> tuple[str, ...]:
    """One command line for all files, or one for each of the likeliest topics where one has to be named."""
    topics = sorted((topic for survey in surveys for topic in survey.topics if topic.bodies), key=_suits, reverse=True)
    if not any(survey.topics for survey in surveys):
        return (_line(paths),)
    return tuple(_line(paths, "--topic", topic.name) for topic in topics[:_MOST_TOPICS])


def _suits(topic: Topic) -> tuple[bool, float]:
    """What moves comes first, and then what is told most often."""
    rates_hz = [body.timeline.rate_hz or 0.0 for body in topic.bodies]
    return any(body.travel > 0.0 for body in topic.bodies), max(rates_hz)


def _line(paths: Sequence[Path], *options: str) -> str:
    return shlex.join(["mtm-audit", "decode", *map(str, paths), "--key", _KEY, *options])
