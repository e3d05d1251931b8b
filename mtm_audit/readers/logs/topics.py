"""Bags of messages into bodies: which topics hold poses, which are read, and by which clock."""

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.choosing import check_topics, choose, listed
from mtm_audit.readers.logs.columns import at_of_unix_times
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.orientation import quaternions_of_matrices
from mtm_audit.readers.logs.pose_messages import POSE_TYPES, TRANSFORM_TYPES, Samples, poses_of, type_name
from mtm_audit.readers.logs.transforms import Edge, Moving, between, moving_of, pairs
from mtm_onboard.protocol.errors import MtmError

_MOST_NAMED = 20


@dataclass(frozen=True)
class Channel:
    """A topic of a bag and the full name of its messages' type."""

    topic: str
    type_name: str

    @property
    def kind(self) -> str:
        """The type's name without its package."""
        return type_name(self.type_name)


class Bag(Protocol):
    """Messages by topic, whatever file they come from."""

    @property
    def channels(self) -> Sequence[Channel]:
        """All topics, without repeats."""

    def messages(self, topics: Collection[str]) -> Iterator[tuple[Channel, int, Any]]:
        """Channel, time of arrival in nanoseconds and decoded message, in the order of arrival."""


def bodies_of_bag(path: Path, what: str, bag: Bag, options: ReadOptions, warn: Warn) -> Log:
    """The bodies of the topics asked for, or of the only ones with poses.

    Topics of one name in several namespaces are several robots and all read; a transform is asked for as
    `/tf:odom.base_link`. Raises MtmError that lists the topics when there is a choice, or says what there is when
    nothing has a pose.
    """
    transforms = [channel for channel in bag.channels if channel.kind in TRANSFORM_TYPES]
    poses = [channel for channel in bag.channels if channel.kind in POSE_TYPES]
    asked = _asked(path, bag, transforms, options)
    if not asked:
        asked = _only([channel.topic for channel in poses])
    wanted = {topic for topic in asked if topic not in _pairs_asked(asked)}
    if asked and not _pairs_asked(asked):
        bodies = _posed(path, bag, wanted, options, warn)
    elif asked or (transforms and not poses):
        bodies = _posed(path, bag, wanted, options, warn) if wanted else []
        bodies += _transformed(path, bag, transforms, _pairs_asked(asked), options, warn, alone=not wanted)
    elif poses:
        raise choose(path, [channel.topic for channel in poses] + _offers(path, bag, transforms, options))
    else:
        kinds = sorted({f"{channel.topic} ({channel.type_name})" for channel in bag.channels})
        raise MtmError(f"{path} is {what} without a topic of poses; it has: {listed(kinds) or 'no messages'}")
    return Log(tuple(bodies), at=at_of_unix_times(bodies[0].times_s) if bodies else None)


def _asked(path: Path, bag: Bag, transforms: Sequence[Channel], options: ReadOptions) -> list[str]:
    plain = [topic for topic in options.topics if topic not in _pairs_asked(options.topics)]
    check_topics(path, plain, [channel.topic for channel in bag.channels])
    for topic in plain:
        if topic in {channel.topic for channel in transforms}:
            offers = _offers(path, bag, transforms, options)
            raise MtmError(f"{path}: {topic} holds many frames; name two of them: {listed(offers)}")
    if _pairs_asked(options.topics) and not transforms:
        raise MtmError(f"{path} has no transforms; name a topic of poses")
    return list(options.topics)


def _pairs_asked(topics: Sequence[str]) -> list[str]:
    return [topic for topic in topics if ":" in topic]


def _only(topics: Sequence[str]) -> list[str]:
    """The one topic, or those that differ in nothing but the namespace; none when there is a choice."""
    leaves = {topic.rpartition("/")[2] for topic in topics}
    return list(dict.fromkeys(topics)) if len(set(topics)) == 1 or len(leaves) == 1 else []


def _posed(path: Path, bag: Bag, topics: Collection[str], options: ReadOptions, warn: Warn) -> list[Body]:
    found: dict[tuple[str, str], Samples] = defaultdict(Samples)
    paths: dict[str, tuple[int, Any]] = {}
    for channel, arrival_ns, message in bag.messages(topics):
        if channel.kind == "Path":
            # Each holds all poses so far.
            paths[channel.topic] = arrival_ns, message
            continue
        for _, child, stamp_ns, pose in poses_of(message, channel.kind):
            found[channel.topic, child].add(stamp_ns, arrival_ns, pose)
    for topic, (arrival_ns, message) in paths.items():
        for _, child, stamp_ns, pose in poses_of(message, "Path"):
            found[topic, child].add(stamp_ns, arrival_ns, pose)
    for topic in topics:
        if not any(key[0] == topic for key in found):
            raise MtmError(f"{path}: {topic} has no message with a position; name another topic")
    names = _names(path, list(found))
    return [_body(path, names[key], key, samples, options, warn) for key, samples in found.items()]


def _body(path: Path, name: str, key: tuple[str, str], samples: Samples, options: ReadOptions, warn: Warn) -> Body:
    arrival = options.arrival_times or not samples.stamped
    if arrival and len(set(samples.arrivals_ns)) <= len(samples) // 2:
        raise MtmError(f"{path}: the poses of {key[0]} have no times of their own; name another topic")
    if arrival and not options.arrival_times:
        warn(f"{path}: messages of {key[0]} carry no time, so the instants at which they were recorded are used")
    times_s = samples.times_s(arrival=arrival)
    return Body(name, times_s, samples.positions() * options.metres(), samples.quaternions_xyzw(), up=options.up or "z")


def _names(path: Path, keys: Sequence[tuple[str, str]]) -> dict[tuple[str, str], str]:
    """Names of bodies: the file's for one; else the frame's where a topic has several, or the topic's namespace."""
    if len(keys) == 1:
        return {keys[0]: path.stem}
    children = defaultdict(list)
    for topic, child in keys:
        children[topic].append(child)
    shared = len({topic.rpartition("/")[2] for topic in children}) == 1 and len(children) > 1
    names = {}
    for topic, child in keys:
        short = (topic.rpartition("/")[0] if shared else topic).strip("/") or topic
        names[topic, child] = (
            short if len(children[topic]) == 1 else child if len(children) == 1 else f"{short}/{child}"
        )
    return names


def _edges(path: Path, bag: Bag, transforms: Sequence[Channel], options: ReadOptions) -> Mapping[Edge, Moving]:
    found: dict[Edge, Samples] = defaultdict(Samples)
    for channel, arrival_ns, message in bag.messages({channel.topic for channel in transforms}):
        for parent, child, stamp_ns, pose in poses_of(message, channel.kind):
            found[parent, child].add(stamp_ns, arrival_ns, pose)
    if not found:
        raise MtmError(f"{path}: its transforms are empty; record /tf again")
    return {
        edge: moving_of(samples, arrival=options.arrival_times or not samples.stamped)
        for edge, samples in found.items()
    }


def _offers(path: Path, bag: Bag, transforms: Sequence[Channel], options: ReadOptions) -> list[str]:
    if not transforms:
        return []
    return [f"/tf:{parent}.{child}" for parent, child in pairs(_edges(path, bag, transforms, options))][:_MOST_NAMED]


def _transformed(
    path: Path,
    bag: Bag,
    transforms: Sequence[Channel],
    asked: Sequence[str],
    options: ReadOptions,
    warn: Warn,
    *,
    alone: bool,
) -> list[Body]:
    edges = _edges(path, bag, transforms, options)
    offered = pairs(edges)
    if not asked and len(offered) != 1:
        if not offered:
            raise MtmError(f"{path} holds transforms that never change, so nothing moves in it; record /tf as well")
        raise choose(path, [f"/tf:{parent}.{child}" for parent, child in offered])
    chosen = [_pair(path, topic, edges) for topic in asked] if asked else offered
    bodies = []
    for parent, child in chosen:
        moving = between(edges, parent, child)
        name = path.stem if len(chosen) == 1 and alone else child
        turns = quaternions_of_matrices(moving.matrices[:, :3, :3])
        positions_m = np.asarray(moving.matrices[:, :3, 3]) * options.metres()
        bodies.append(Body(name, moving.times_s, positions_m, turns, up=options.up or "z"))
    if not asked:
        warn(f"{path}: {offered[0][1]} is followed in the frame {offered[0][0]}")
    return bodies


def _pair(path: Path, topic: str, edges: Mapping[Edge, Moving]) -> Edge:
    """The two frames of "/tf:parent.child", whose names may hold dots themselves."""
    frames = {frame for edge in edges for frame in edge}
    pieces = topic.partition(":")[2].split(".")
    for cut in range(1, len(pieces)):
        parent, child = (".".join(part).strip("/") for part in (pieces[:cut], pieces[cut:]))
        if parent in frames and child in frames:
            return parent, child
    raise MtmError(f"{path} has no frames {topic!r}; write /tf:PARENT.CHILD with two of: {listed(sorted(frames))}")
