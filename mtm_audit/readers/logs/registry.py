"""All formats of logs and motion capture: which one a file is of, and reading it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Track
from mtm_audit.readers.formats.c3d import read_c3d, recognises_c3d
from mtm_audit.readers.formats.crazyflie import read_crazyflie, recognises_crazyflie
from mtm_audit.readers.formats.crazyflie_card import read_crazyflie_card, recognises_crazyflie_card
from mtm_audit.readers.formats.dataflash import read_dataflash, recognises_dataflash
from mtm_audit.readers.formats.headed import read_headed, recognises_headed
from mtm_audit.readers.formats.kitti import read_kitti, recognises_kitti
from mtm_audit.readers.formats.lerobot import read_lerobot, recognises_lerobot
from mtm_audit.readers.formats.mcap import read_mcap, recognises_mcap
from mtm_audit.readers.formats.motive import read_motive, recognises_motive
from mtm_audit.readers.formats.mrclam import read_mrclam, recognises_mrclam
from mtm_audit.readers.formats.qualisys import read_qualisys, recognises_qualisys
from mtm_audit.readers.formats.rosbag import read_rosbag1, read_rosbag2, recognises_rosbag1, recognises_rosbag2
from mtm_audit.readers.formats.rostopic import read_rostopic, recognises_rostopic
from mtm_audit.readers.formats.tlog import read_tlog, recognises_tlog
from mtm_audit.readers.formats.tum import read_tum, recognises_tum
from mtm_audit.readers.formats.ulog import read_ulog, recognises_ulog
from mtm_audit.readers.formats.vicon import read_vicon, recognises_vicon
from mtm_audit.readers.logs.body import Log, Warn, track_of
from mtm_audit.readers.logs.choosing import SeveralPosesError
from mtm_audit.readers.logs.opening import Opening, opening_of
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.table import cells_of, separator_of
from mtm_onboard.protocol.errors import MtmError


@dataclass(frozen=True)
class Format:
    """One format: its `name` in words, what recognises it by a file's opening, and what reads a file of it."""

    name: str
    recognises: Callable[[Opening], bool]
    read: Callable[[Path, ReadOptions, Warn], Log]


@dataclass(frozen=True)
class Contents:
    """The tracks of a log, one for each body, and when its clock stood at zero if it tells."""

    tracks: tuple[Track, ...]
    at: RecordedAt | None = None


# What says by itself what it is comes first; tables of numbers last.
FORMATS = (
    Format("PX4 ULog", recognises_ulog, read_ulog),
    Format("ArduPilot DataFlash", recognises_dataflash, read_dataflash),
    Format("ROS 1 bag", recognises_rosbag1, read_rosbag1),
    Format("ROS 2 bag", recognises_rosbag2, read_rosbag2),
    Format("MCAP", recognises_mcap, read_mcap),
    Format("parquet", recognises_lerobot, read_lerobot),
    Format("Crazyflie card", recognises_crazyflie_card, read_crazyflie_card),
    Format("MAVLink telemetry", recognises_tlog, read_tlog),
    Format("Motive CSV", recognises_motive, read_motive),
    Format("Vicon CSV", recognises_vicon, read_vicon),
    Format("Qualisys TSV", recognises_qualisys, read_qualisys),
    Format("rostopic echo", recognises_rostopic, read_rostopic),
    Format("Crazyflie log", recognises_crazyflie, read_crazyflie),
    Format("MR.CLAM ground truth", recognises_mrclam, read_mrclam),
    Format("TUM trajectory", recognises_tum, read_tum),
    Format("KITTI poses", recognises_kitti, read_kitti),
    Format("table with a header", recognises_headed, read_headed),
    Format("C3D", recognises_c3d, read_c3d),
)
_TABLE = next(item for item in FORMATS if item.read is read_headed)
_TUM = next(item for item in FORMATS if item.read is read_tum)

# Files that people have beside recordings or take for them: how they begin, and what to do instead.
_FOREIGN = (
    (b"HIERARCHY", "a BVH animation, which has no measured times", "export C3D or CSV"),
    (b"PathFileType", "a TRC file of markers", "export C3D"),
    (b"\x89HDF", "an HDF5 file", "export a table with the header 'time,x,y,yaw'"),
    (b"MATLAB 5.0", "a MATLAB file", "export a table with the header 'time,x,y,yaw'"),
    (b"PK\x03\x04", "a ZIP archive or a spreadsheet", "unpack it, or save it as CSV"),
    (b"\x1f\x8b", "a gzip archive", "unpack it"),
    (b"\x28\xb5\x2f\xfd", "a zstd archive", "unpack it"),
    (b"%PDF", "a PDF document", "name the recording"),
    (b"SQLite format 3\0", "a database of sqlite not called .db3, as a bag is", "rename it if it is one"),
    (b"\x93NUMPY", "an array of numpy", "save it as a table with the header 'time,x,y,yaw'"),
    (b"rosbag2_bagfile_information", "the description of a bag of ROS 2", "name the bag's folder or its file"),
    (b"{", "JSON", "export a table with the header 'time,x,y,yaw'"),
    (b"<?xml", "XML", "export a table with the header 'time,x,y,yaw'"),
)  # fmt: skip


def format_of(opening: Opening) -> Format | None:
    """The format that a file or folder is of; None when nothing recognises it."""
    return next((item for item in FORMATS if item.recognises(opening)), None)


def check_foreign(opening: Opening) -> None:
    """Raise MtmError that names the format of a file that is known and not read."""
    start = opening.start.removeprefix(b"\xef\xbb\xbf")
    for magic, what, advice in _FOREIGN:
        if start.startswith(magic):
            raise MtmError(f"{opening.path} is {what}, which is not read; {advice}")


def read_log(path: Path, options: ReadOptions | None = None, warn: Warn | None = None) -> Contents:
    """The tracks of one log or motion-capture file, of whatever format it is.

    `warn` receives one sentence for each thing that is wrong but leaves something to use. Raises MtmError when the file
    cannot be used; it names the format where one was recognised.
    """
    asked = options or ReadOptions()

    def told(sentence: str) -> None:
        if warn is not None:
            warn(_printable(sentence))

    try:
        opening = opening_of(path)
        # Damaged numbers are infinite or none, which is told where they are left out.
        with np.errstate(all="ignore"):
            log = (format_of(opening) or _likeliest(opening)).read(path, asked, told)
            tracks = tuple(track_of(body, str(path), told, asked.heading_axis) for body in log.bodies) + log.tracks
        return Contents(_distinct(path, tracks), log.at)
    except SeveralPosesError as error:
        raise SeveralPosesError(_printable(str(error)), [_printable(name) for name in error.offered]) from error
    except MtmError as error:
        raise MtmError(_printable(str(error))) from error


def _printable(text: str) -> str:
    """The text in one line, without what would command a terminal: names come from files."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _likeliest(opening: Opening) -> Format:
    """What text that nothing recognises was meant to be, whose reader says what is wrong with it."""
    check_foreign(opening)
    if not opening.is_text:
        raise MtmError(f"{opening.path} is of no format that is read; docs/formats.md names them")
    first = opening.content[0] if opening.content else ""
    if opening.suffix == ".csv" or separator_of(first) is not None or _is_words(first):
        return _TABLE
    return _TUM


def _is_words(line: str) -> bool:
    """Whether a line is of words, as a header is."""
    try:
        cells = cells_of(line, separator_of(line))
    except ValueError:
        return False
    return (
        len(cells) > 2 and all(cell[:1].isalpha() for cell in cells) and cells[0].lower() in ("time", "t", "timestamp")
    )


def _distinct(path: Path, tracks: tuple[Track, ...]) -> tuple[Track, ...]:
    tracks = tuple(replace(track, name=_printable(track.name)) for track in tracks)
    names = [track.name for track in tracks]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise MtmError(f"{path} has two bodies {twice!r}; rename one or choose with --topic")
    return tracks
