"""Which recordings the named files and folders are, before anything of them is read."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mtm_audit.ingest.chapters import films_of
from mtm_audit.ingest.films import is_picture
from mtm_audit.ingest.load import VIDEO_SUFFIXES, is_video
from mtm_audit.model.recording import Kind
from mtm_audit.readers.picture_folder import pictures_in
from mtm_onboard.protocol.errors import MtmError

_MOTION_CAPTURE_SUFFIXES = frozenset({".csv", ".tum", ".txt"})
# Where `mtm-hil record` puts the motion capture.
_MOTION_CAPTURE_FOLDER = "mocap"


@dataclass(frozen=True)
class Source:
    """One recording: a video, the chapters of one, a folder of pictures, or motion-capture files of several bodies."""

    files: tuple[Path, ...]
    kind: Kind

    @property
    def name(self) -> str:
        """How to name it in a sentence."""
        return str(self.files[0]) + (f" and {len(self.files) - 1} more" if len(self.files) > 1 else "")


def sources_of(paths: Sequence[Path]) -> tuple[Source, ...]:
    """The recordings behind `paths`: each film is one, all motion-capture files together are one.

    A folder stands for the films in it, or else for its pictures as one film, or else for its motion capture. Raises
    MtmError when a file is missing or empty, a folder holds nothing of these, or films come with motion capture.
    """
    folders = [path for path in paths if path.is_dir()]
    found = [source for folder in folders for source in _in_folder(folder)]
    files = [path for path in paths if not path.is_dir()]
    pictures = tuple(path for path in files if is_picture(path))
    others = [path for path in files if path not in pictures]
    videos = [path for path in others if is_video(path)]
    found += [Source(film, "video") for film in films_of(videos)]
    if pictures:
        if len(pictures) == 1:
            raise MtmError(f"{pictures[0]} is a single picture; name a folder of them, or a video")
        found.append(Source(pictures, "video"))
    found += [Source((path,), "motion capture") for path in others if path not in videos]
    return _joined(found)


def _joined(found: Sequence[Source]) -> tuple[Source, ...]:
    films = tuple(source for source in found if source.kind == "video")
    bodies = tuple(file for source in found if source.kind != "video" for file in source.files)
    if films and bodies:
        raise MtmError(f"{films[0].name} is a film and {bodies[0]} is motion capture; decode them one by one")
    return films or (Source(bodies, "motion capture"),)


def _in_folder(folder: Path) -> list[Source]:
    try:
        files = sorted(path for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
    except OSError as error:
        raise MtmError(f"{folder} cannot be read ({error.strerror}); check its permissions") from error
    videos = [path for path in files if path.suffix.lower() in VIDEO_SUFFIXES]
    if videos:
        return [Source(film, "video") for film in films_of(videos)]
    if pictures_in(folder):
        return [Source((folder,), "video")]
    bodies = tuple(path for path in files if path.suffix.lower() in _MOTION_CAPTURE_SUFFIXES)
    if bodies:
        return [Source(bodies, "motion capture")]
    if (folder / _MOTION_CAPTURE_FOLDER).is_dir():
        return _in_folder(folder / _MOTION_CAPTURE_FOLDER)
    raise MtmError(
        f"the folder {folder} holds no video, no pictures and no motion-capture file (.tum, .csv or .txt); name such a "
        "folder or file"
    )
