"""A survey as JSON, for programs; docs/look.md describes it and look.schema.json checks it."""

import json
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

from mtm_audit.survey.film import FilmSurvey
from mtm_audit.survey.log import Body, LogSurvey
from mtm_audit.survey.timeline import Timeline
from mtm_onboard.protocol.installing import DISTRIBUTION

SCHEMA_VERSION = 1


def look_report(recordings: Sequence[dict[str, Any]]) -> str:
    """One JSON object with all recordings, each as `film_entry` or `log_entry` gives it, and a newline at its end."""
    report = {
        "schema_version": SCHEMA_VERSION,
        "program": {"name": "mtm-audit", "version": version(DISTRIBUTION)},
        "recordings": list(recordings),
    }
    return json.dumps(report, indent=2, allow_nan=False) + "\n"


def film_entry(survey: FilmSurvey, commands: Sequence[str]) -> dict[str, Any]:
    """A film; places are columns and rows of pixels from the upper left corner."""
    made, coded = survey.structure, survey.compression
    return {
        "kind": "film",
        "paths": [str(path) for path in survey.files],
        "container": None if made is None else made.container,
        "codec": None if made is None else made.codec,
        "size_px": list(survey.size),
        "turned_deg": None if made is None else made.turned_deg,
        "mirrored": made is not None and made.mirrored,
        "times": "single pictures" if made is None else made.times,
        "timeline": _timeline(survey.timeline),
        "hidden_pictures": 0 if made is None else made.hidden,
        "recorded_unix_s": survey.recorded_unix_s,
        "camera": {"motion_px": survey.camera.rms_px, "sentence": survey.camera.sentence},
        "markers": [
            {
                "dictionary": marker.dictionary,
                "number": marker.number,
                "side_px": marker.side_px,
                "corners_px": marker.corners[min(marker.corners)].tolist(),
                "at_s": survey.kept[min(marker.corners)].time_s,
            }
            for marker in survey.markers.markers
        ],
        "markers_mirrored": survey.markers.mirrored,
        "colours": [
            {
                "colour": colour.name,
                "hue_deg": colour.hue_deg,
                "patches": colour.patches,
                "share": colour.share,
                "moves": colour.moves,
                "region_px": list(colour.boxes[min(colour.boxes)]),
                "at_s": survey.kept[min(colour.boxes)].time_s,
            }
            for colour in survey.colours
        ],
        "regions_px": [list(region) for region in survey.regions],
        "motions": [
            {
                "track": motion.name,
                "seen": motion.seen,
                "travel_px": motion.travel_px,
                "fast_px": motion.fast_px,
                "has_heading": motion.has_heading,
            }
            for motion in survey.motions
        ],
        "smallest_motion_px": None if coded is None else list(coded.smallest_motion_px),
        "bits_per_pixel": None if coded is None else coded.bits_per_pixel,
        "highest_hz": survey.highest_hz,
        "trackers": list(survey.trackers),
        "reference": list(survey.reference),
        "commands": list(commands),
        "warnings": list(survey.warnings),
    }


def log_entry(survey: LogSurvey, commands: Sequence[str]) -> dict[str, Any]:
    """A log or motion-capture file."""
    return {
        "kind": "log",
        "paths": [str(survey.path)],
        "format": survey.format,
        "begun_unix_s": survey.begun_unix_s,
        "bodies": [_body(body) for body in survey.bodies],
        "topics": [
            {"name": topic.name, "bodies": [_body(body) for body in topic.bodies], "refusal": topic.refusal}
            for topic in survey.topics
        ],
        "commands": list(commands),
        "warnings": list(survey.warnings),
    }


def _body(body: Body) -> dict[str, Any]:
    return {
        "name": body.name,
        "timeline": _timeline(body.timeline),
        "unit": body.unit,
        "axes": list(body.axes),
        "seen": body.seen,
        "headings": body.headings,
        "heading_axis": body.heading_axis,
        "travel": body.travel,
    }


def _timeline(timeline: Timeline) -> dict[str, Any]:
    return {
        "count": timeline.count,
        "begin_s": timeline.begin_s,
        "duration_s": timeline.duration_s,
        "rate_hz": timeline.rate_hz,
        "constant": timeline.is_constant,
        "gaps": timeline.gaps,
        "missing": timeline.missing,
        "longest_s": timeline.longest_s,
    }
