"""Bags of ROS 1 and of ROS 2 (sqlite3, or a folder of either kind), by rosbags."""

from collections.abc import Collection, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mtm_audit.readers.formats.mcap import open_mcap
from mtm_audit.readers.logs.body import Log, Warn
from mtm_audit.readers.logs.libraries import foreign, library
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.ros_types import decoder
from mtm_audit.readers.logs.topics import Bag, Channel, bodies_of_bag
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, read_text

WHAT_1, WHAT_2 = "a bag of ROS 1", "a bag of ROS 2"
METADATA = "metadata.yaml"
_MARK = "rosbag2_bagfile_information"


def recognises_rosbag1(opening: Opening) -> bool:
    """Whether it begins with the name and version of the format."""
    return opening.start.startswith(b"#ROSBAG V2.0")


def recognises_rosbag2(opening: Opening) -> bool:
    """Whether it is a file of sqlite that is called like a bag, or a folder with the description of one."""
    if opening.path.is_dir():
        return is_bag_folder(opening.path)
    return opening.start.startswith(b"SQLite format 3\0") and opening.suffix == ".db3"


def is_bag_folder(path: Path) -> bool:
    """Whether a folder has a bag's description in it."""
    try:
        return _MARK in read_text(path / METADATA, "the bag's description")
    except (MtmError, BrokenTextError):
        return False


def read_rosbag1(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """The bodies of one bag; times are those of the messages' headers."""
    rosbag1 = library("rosbags.rosbag1", path, WHAT_1)
    with foreign(path, WHAT_1), rosbag1.Reader(path) as reader:
        return bodies_of_bag(path, WHAT_1, _Read((reader,), "ros1"), options, warn)


def read_rosbag2(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """The bodies of one file or of a folder's files one after the other; times are those of the messages' headers."""
    rosbag2 = library("rosbags.rosbag2", path, WHAT_2)
    with foreign(path, WHAT_2), ExitStack() as stack:
        files = bag_files(path) if path.is_dir() else [path]
        if files and all(file.suffix == ".mcap" for file in files):
            bags = [open_mcap(file, warn) for file in files]
            return bodies_of_bag(path, WHAT_2, _Joined(tuple(bags)), options, warn)
        # A compressed bag is opened as a whole, since its description says how.
        parts = files if files and all(file.suffix == ".db3" for file in files) else [path]
        readers = tuple(stack.enter_context(rosbag2.Reader(part)) for part in parts)
        return bodies_of_bag(path, WHAT_2, _Read(readers, "cdr"), options, warn)


def bag_files(folder: Path) -> list[Path]:
    """The files that a bag's description names, in order, as far as they lie in the folder."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        described = YAML(typ="safe", pure=True).load(read_text(folder / METADATA, "the bag's description"))
        names = [str(name) for name in described[_MARK]["relative_file_paths"]]
    except (YAMLError, BrokenTextError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise MtmError(f"{folder / METADATA} does not describe a bag; copy it again, or name the bag's file") from error
    # Older ones name the folder too.
    files = [folder / Path(name).name for name in names]
    return [file for file in files if file.is_file()]


@dataclass(frozen=True)
class _Read:
    """Readers of rosbags, one after the other."""

    readers: tuple[Any, ...]
    encoding: str

    @property
    def channels(self) -> tuple[Channel, ...]:
        found = [Channel(c.topic, c.msgtype) for reader in self.readers for c in reader.connections]
        return tuple(dict.fromkeys(found))

    def messages(self, topics: Collection[str]) -> Iterator[tuple[Channel, int, Any]]:
        for reader in self.readers:
            wanted = [connection for connection in reader.connections if connection.topic in topics]
            if not wanted:
                continue
            decoders = {c.id: (Channel(c.topic, c.msgtype), self._decoder(c)) for c in wanted}
            for connection, arrival_ns, data in reader.messages(connections=wanted):
                channel, decode = decoders[connection.id]
                yield channel, arrival_ns, decode(data)

    def _decoder(self, connection: Any) -> Any:
        form = connection.msgdef.format.name.lower()
        return decoder(connection.msgtype, connection.msgdef.data, form, self.encoding)


@dataclass(frozen=True)
class _Joined:
    """Bags one after the other."""

    bags: tuple[Bag, ...]

    @property
    def channels(self) -> tuple[Channel, ...]:
        return tuple(dict.fromkeys(channel for bag in self.bags for channel in bag.channels))

    def messages(self, topics: Collection[str]) -> Iterator[tuple[Channel, int, Any]]:
        for bag in self.bags:
            yield from bag.messages(topics)
