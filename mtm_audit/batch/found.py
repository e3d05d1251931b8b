"""Which recordings the paths of a batch stand for; one that cannot be read keeps no other from being found."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mtm_audit.ingest.chapters import chapters_of, check_whole
from mtm_audit.ingest.films import is_picture
from mtm_audit.ingest.load import VIDEO_SUFFIXES, is_video
from mtm_audit.ingest.logs import log_files
from mtm_audit.ingest.source import Source
from mtm_audit.readers.picture_folder import pictures_in
from mtm_onboard.protocol.errors import MtmError


@dataclass(frozen=True)
class Found:
    """A recording by the `name` that its row has, and its files, whose paths are absolute so that they mean the same in
    every process; without `source` the `refusal` says why not.
    """

    name: str
    source: Source | None
    refusal: str = ""


def find_recordings(paths: Sequence[Path], out: Path) -> tuple[Found, ...]:
    """The recordings in the order of `paths`, those of a folder by name, each once; the table `out` is none of them.

    Each file is a recording of its own, but for the chapters of a film and several pictures of one folder. In a folder
    each film is one, its logs together are another, and so are its pictures where it holds no film; then come its
    folders. Nothing that is wrong with one raises an error.
    """
    found: list[Found] = []
    files: list[Path] = []
    for path in paths:
        if path.is_dir():
            found += [*_of_files(files), *(_in_folder(path, out) or [_nothing_in(path)])]
            files = []
        else:
            files.append(path)
    found += _of_files(files)
    once: dict[object, Found] = {}
    for item in map(_absolute, found):
        once.setdefault(item.name if item.source is None else item.source.files, item)
    return tuple(once.values())


def _absolute(found: Found) -> Found:
    source = found.source
    if source is None:
        return found
    return replace(found, source=replace(source, files=tuple(file.absolute() for file in source.files)))


def _of_files(paths: Sequence[Path]) -> list[Found]:
    """Files that were named one by one, in their order."""
    films: list[Path] = []
    pictures: dict[Path, list[Path]] = {}
    found: list[tuple[int, Found]] = []
    for place, path in enumerate(paths):
        try:
            if is_picture(path):
                pictures.setdefault(path.parent, []).append(path)
            elif is_video(path):
                films.append(path)
            else:
                found.append((place, Found(str(path), Source((path,), "motion capture"))))
        except MtmError as error:
            found.append((place, Found(str(path), None, str(error))))
    places = {path: place for place, path in reversed(list(enumerate(paths)))}
    found += [(min(places[path] for path in film), _film(film)) for film in chapters_of(films)]
    for group in pictures.values():
        film = Found(str(group[0]), Source(tuple(group), "video"))
        single = f"{group[0]} is a single picture; name a folder of them, or a video"
        found.append((places[group[0]], film if len(group) > 1 else Found(str(group[0]), None, single)))
    return [item for _, item in sorted(found, key=lambda entry: entry[0])]


def _film(chapters: tuple[Path, ...]) -> Found:
    try:
        check_whole(chapters)
    except MtmError as error:
        return Found(str(chapters[0]), None, str(error))
    return Found(str(chapters[0]), Source(chapters, "video"))


def _in_folder(folder: Path, out: Path) -> list[Found]:
    """The recordings in a folder and in its folders; none when there are none."""
    try:
        entries = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError as error:
        return [Found(str(folder), None, f"{folder} cannot be read ({error.strerror}); check its permissions")]
    # Not only when all are whole: one film with a missing chapter does not hide the others.
    videos = [path for path in entries if path.suffix.lower() in VIDEO_SUFFIXES and path.is_file()]
    found = [_film(chapters) for chapters in chapters_of(videos)]
    pictures = not videos and bool(pictures_in(folder))
    found += [Found(str(folder), Source((folder,), "video"))] if pictures else _logs_in(folder, out)
    # What lies in a bag's folder are its parts.
    if any(item.source is not None and not pictures and folder in item.source.files for item in found):
        return found
    # Links could lead back to a folder above.
    deeper = [_in_folder(entry, out) for entry in entries if entry.is_dir() and not entry.is_symlink()]
    return [*found, *(item for items in deeper for item in items)]


def _logs_in(folder: Path, out: Path) -> list[Found]:
    """The logs of a folder, which are one recording."""
    left_out: list[str] = []
    files = tuple(file for file in log_files(folder, left_out.append) if file.absolute() != out.absolute())
    if not files:
        return []
    place = files[0] if len(files) == 1 else folder
    return [Found(str(place), Source(files, "motion capture", tuple(left_out)))]


def _nothing_in(folder: Path) -> Found:
    return Found(
        str(folder), None, f"the folder {folder} holds no recording that is read (docs/formats.md); leave it out"
    )
