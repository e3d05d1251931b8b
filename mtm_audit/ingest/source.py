"""Which recordings the named files and folders are, before anything of them is read."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mtm_audit.ingest.chapters import films_of
from mtm_audit.ingest.films import is_picture
from mtm_audit.ingest.load import VIDEO_SUFFIXES, is_video
from mtm_audit.ingest.logs import log_files
from mtm_audit.model.recording import Kind
from mtm_audit.readers.picture_folder import pictures_in
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.secret_file import holds_secret

# Where `mtm-hil record` puts the motion capture.
_MOTION_CAPTURE_FOLDER = "mocap"


@dataclass(frozen=True)
class Source:
    """One recording: a video, the chapters of one, a folder of pictures, or logs and motion capture of several bodies.

    `warnings` say what a folder holds that cannot be read.
    """

    files: tuple[Path, ...]
    kind: Kind
    warnings: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """How to name it in a sentence."""
        return str(self.files[0]) + (f" and {len(self.files) - 1} more" if len(self.files) > 1 else "")


def sources_of(paths: Sequence[Path]) -> tuple[Source, ...]:
    """The recordings behind `paths`: each film is one, all logs and motion-capture files together are one.

    A folder stands for the films in it, or else for its pictures as one film, or else for its logs. Raises
    MtmError when a file is missing or empty, a folder holds nothing of these, or films come with logs.
    """
    folders = [path for path in paths if path.is_dir()]
    found = [source for folder in folders for source in _in_folder(folder)]
    files = [path for path in paths if not path.is_dir()]
    for path in files:
        if os.access(path, os.R_OK) and holds_secret(path):
            raise MtmError(f"{path} is a key file and no recording; name it with --key, and name a recording")
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


def recordings_of(paths: Sequence[Path]) -> tuple[Source, ...]:
    """The recordings behind `paths` where each path is one by itself, films and logs alike; a folder of films several.

    Raises MtmError as `sources_of` does.
    """
    return tuple(source for path in paths for source in sources_of([path]))


def _joined(found: Sequence[Source]) -> tuple[Source, ...]:
    films = tuple(source for source in found if source.kind == "video")
    bodies = tuple(file for source in found if source.kind != "video" for file in source.files)
    if films and bodies:
        raise MtmError(f"{films[0].name} is a film and {bodies[0]} is a log; decode them one by one")
    warnings = tuple(warning for source in found for warning in source.warnings)
    return films or (Source(bodies, "motion capture", warnings),)


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
    left_out: list[str] = []
    logs = log_files(folder, left_out.append)
    if logs:
        return [Source(tuple(logs), "motion capture", tuple(left_out))]
    if (folder / _MOTION_CAPTURE_FOLDER).is_dir():
        return _in_folder(folder / _MOTION_CAPTURE_FOLDER)
    raise MtmError(
        f"the folder {folder} holds no video, no pictures and no log or motion capture of a format that is read "
        "(docs/formats.md); name such a folder or file"
    )
