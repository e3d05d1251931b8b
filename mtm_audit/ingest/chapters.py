"""Films that a camera cut into several files, by the names that cameras give them."""

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from mtm_onboard.protocol.errors import MtmError

# GoPro: GX010123.MP4, GX020123.MP4 (chapter, then film); before 2018 GOPR0123.MP4, GP010123.MP4.
_CHAPTERED = re.compile(r"(?P<head>G[HXLS]|GP)(?P<chapter>\d\d)(?P<film>\d{4})", re.IGNORECASE)
_FIRST = re.compile(r"GOPR(?P<film>\d{4})", re.IGNORECASE)


def films_of(paths: Sequence[Path]) -> list[tuple[Path, ...]]:
    """The files of each film in the order of time; films in the order in which the first of their files comes.

    Raises MtmError when a chapter in the middle of a film is missing, since nobody knows how long it was.
    """
    films = chapters_of(paths)
    for chapters in films:
        check_whole(chapters)
    return films


def chapters_of(paths: Sequence[Path]) -> list[tuple[Path, ...]]:
    """As `films_of`, and a chapter in the middle may be missing, for `check_whole` to say."""
    films: dict[object, list[tuple[int, Path]]] = {}
    for path in paths:
        film, chapter = _place(path)
        films.setdefault(film, []).append((chapter, path))
    return [tuple(path for _, path in sorted(chapters)) for chapters in films.values()]


def check_whole(chapters: Sequence[Path]) -> None:
    """Raise MtmError when a chapter between those of one film is missing."""
    numbered = [(_place(path)[1], path) for path in chapters]
    for (before, path), (after, next_path) in pairwise(numbered):
        if after != before + 1:
            raise MtmError(
                f"{path.name} and {next_path.name} are chapters {before} and {after} of one film, and what lies "
                "between them is missing; add it, or decode the parts one by one"
            )


def _place(path: Path) -> tuple[object, int]:
    """What names the film, and the number of the chapter."""
    later, first = _CHAPTERED.fullmatch(path.stem), _FIRST.fullmatch(path.stem)
    if first is not None:
        return (path.parent, "GP", first["film"], path.suffix.upper()), 0
    if later is not None:
        return (path.parent, later["head"].upper(), later["film"], path.suffix.upper()), int(later["chapter"])
    return path, 0
