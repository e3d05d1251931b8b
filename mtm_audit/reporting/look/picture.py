"""A picture of a film with a grid of pixel numbers and what was found in it."""

from dataclasses import replace

import numpy as np

from mtm_audit.drawing.grid import draw_grid
from mtm_audit.drawing.mark import Mark
from mtm_audit.drawing.overlay import draw
from mtm_audit.drawing.palette import colour_of
from mtm_audit.model.picture import Image
from mtm_audit.model.track import Floats
from mtm_audit.survey.film import FilmSurvey
from mtm_audit.tracking.cover import parse_colour
from mtm_audit.tracking.region import Region


def survey_picture(survey: FilmSurvey) -> Image:
    """The picture that shows most markers and colours, or the first, in which regions are meant, (height, width, 3)."""
    number = _most_telling(survey)
    frame = survey.kept[number]
    marks = [*_markers(survey, number), *_colours(survey, number)]
    if number == 0:
        marks += [_region_mark(f"flow:{','.join(map(str, region))}", region, 0) for region in survey.regions]
    coloured = [
        mark if mark.name.startswith("#") else replace(mark, colour=colour_of(place))
        for place, mark in enumerate(marks)
    ]
    names = survey.files[0].name + (f" and {len(survey.files) - 1} more" if len(survey.files) > 1 else "")
    return draw(draw_grid(frame.image), coloured, [f"{names} at {frame.time_s:.3f} s"])


def _most_telling(survey: FilmSurvey) -> int:
    shown = [
        sum(number in marker.corners for marker in survey.markers.markers)
        + sum(number in colour.boxes for colour in survey.colours if not colour.is_background)
        for number in range(len(survey.kept))
    ]
    return int(np.argmax(shown))


def _markers(survey: FilmSurvey, number: int) -> list[Mark]:
    several = len(survey.markers.dictionaries) > 1
    return [
        Mark(
            name=f"{marker.dictionary} {marker.name}" if several else marker.name,
            place=_middle(marker.corners[number]),
            outline=marker.corners[number],
        )
        for marker in survey.markers.markers
        if number in marker.corners
    ]


def _colours(survey: FilmSurvey, number: int) -> list[Mark]:
    return [
        replace(_region_mark(colour.name, colour.boxes[number], 2), colour=parse_colour(colour.name))
        for colour in survey.colours
        if number in colour.boxes and not colour.is_background
    ]


def _region_mark(name: str, region: Region, margin_px: int) -> Mark:
    left, upper, right, lower = region
    low, high = np.array([left, upper]) - margin_px, np.array([right - 1, lower - 1]) + margin_px
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]], dtype=float)
    return Mark(name=name, place=_middle(corners), outline=corners)


def _middle(corners: Floats) -> tuple[float, float]:
    column, row = corners.mean(axis=0)
    return float(column), float(row)
