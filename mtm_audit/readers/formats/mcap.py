"""MCAP files of any make: messages of ROS, and poses in protobuf or JSON as Foxglove has them, by mcap."""

import json
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from mtm_audit.readers.logs.body import Log, Warn
from mtm_audit.readers.logs.libraries import foreign, library
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.ros_types import decoder, full_name
from mtm_audit.readers.logs.topics import Channel, bodies_of_bag
from mtm_onboard.protocol.errors import MtmError

WHAT = "an MCAP file"
MAGIC = b"\x89MCAP0\r\n"

Found = tuple[Any, Any, Any]


def recognises_mcap(opening: Opening) -> bool:
    """Whether it begins with the format's magic bytes."""
    return opening.start.startswith(MAGIC)


def read_mcap(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """The bodies of one file, also of one that lost its end; times are those that messages carry."""
    bag = open_mcap(path, warn)
    with foreign(path, WHAT):
        return bodies_of_bag(path, WHAT, bag, options, warn)


def open_mcap(path: Path, warn: Warn) -> "McapBag":
    """The messages of a file; raises MtmError when the library is missing."""
    library("mcap.reader", path, WHAT)
    return McapBag(path, warn)


@dataclass(frozen=True)
class McapBag:
    """Topics and messages of one file. Of one that was cut short, what is whole; `warn` is told how much that is."""

    path: Path
    warn: Warn
    _decoders: dict[int, Callable[[bytes], Any]] = field(default_factory=dict)

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """All topics with a schema, without repeats."""
        summary = self._summary
        pairs = (
            [(channel, summary.schemas.get(channel.schema_id)) for channel in summary.channels.values()]
            if summary is not None and summary.channels
            else list({channel.id: (channel, schema) for schema, channel, _ in self._whole_messages(None)}.values())
        )
        return tuple(dict.fromkeys(_channel(channel, schema) for channel, schema in pairs if schema is not None))

    def messages(self, topics: Collection[str]) -> Iterator[tuple[Channel, int, Any]]:
        """Channel, time of arrival in nanoseconds and decoded message, by arrival."""
        found = self._indexed(topics) if self._summary is not None else self._whole_messages(topics)
        for schema, channel, message in found:
            if schema is not None:
                yield _channel(channel, schema), message.log_time, self._decoder(channel, schema)(message.data)

    @cached_property
    def _summary(self) -> Any:
        """The index at the end, or None when the file has none that can be used."""
        from mcap.reader import make_reader

        try:
            with self.path.open("rb") as file:
                summary = make_reader(file).get_summary()
        except Exception:
            # Cut or damaged in whatever way; what is whole is read from the front.
            return None
        return summary if summary is not None and summary.chunk_indexes else None

    def _indexed(self, topics: Collection[str]) -> Iterator[Found]:
        from mcap.reader import make_reader

        with self.path.open("rb") as file:
            yield from make_reader(file).iter_messages(topics=list(topics))

    def _whole_messages(self, topics: Collection[str] | None) -> Iterator[Found]:
        """Messages from the front up to the first damage, sorted by arrival."""
        from mcap.reader import NonSeekingReader

        found: list[Found] = []
        size, read = self.path.stat().st_size, 0
        with self.path.open("rb") as file:
            try:
                # In the order of the file, since sorting would need its end.
                for item in NonSeekingReader(file).iter_messages(
                    topics=None if topics is None else list(topics), log_time_order=False
                ):
                    found.append(item)
                    read = file.tell()
            except Exception:
                if topics is not None:
                    lost = 1.0 - read / size
                    self.warn(
                        f"{self.path} was cut short or is damaged: {len(found)} messages are whole, and the last "
                        f"{lost:.0%} of its bytes were left out"
                    )
        if not found and topics is None:
            raise MtmError(f"{self.path} is {WHAT} without a whole message; copy it again")
        yield from sorted(found, key=lambda item: item[2].log_time)

    def _decoder(self, channel: Any, schema: Any) -> Callable[[bytes], Any]:
        if channel.id not in self._decoders:
            self._decoders[channel.id] = self._make_decoder(channel, schema)
        return self._decoders[channel.id]

    def _make_decoder(self, channel: Any, schema: Any) -> Callable[[bytes], Any]:
        form = {"ros1msg": "msg", "ros2msg": "msg", "ros2idl": "idl"}.get(schema.encoding)
        if channel.message_encoding in ("ros1", "cdr") and form is not None:
            library("rosbags.typesys", self.path, f"{WHAT} of ROS messages")
            definition = schema.data.decode("utf-8", "replace")
            return decoder(full_name(schema.name), definition, form, channel.message_encoding)
        if channel.message_encoding == "json":
            return json.loads
        if channel.message_encoding == "protobuf":
            factory = library("mcap_protobuf.decoder", self.path, f"{WHAT} of protobuf messages").DecoderFactory()
            decode: Callable[[bytes], Any] = factory.decoder_for("protobuf", schema)
            return decode
        raise MtmError(
            f"{self.path}: {channel.topic} is encoded as {channel.message_encoding or 'nothing named'}, which is not "
            "read; record ROS, protobuf or JSON"
        )


def _channel(channel: Any, schema: Any) -> Channel:
    return Channel(channel.topic, schema.name)
