"""Definitions of ROS messages: each connection's own, which two recordings of one name may have differently."""

from collections.abc import Callable
from functools import cache
from typing import Any

_IDL_BREAK = "=" * 80 + "\n"


@cache
def decoder(type_name: str, definition: str, form: str, encoding: str) -> Callable[[bytes], Any]:
    """What decodes messages of a type by their own `definition`, of the `form` msg or idl, or none at all.

    `encoding` is "ros1" or "cdr". Bags of ROS 2 before Iron hold no definitions; the types that come with it have kept
    theirs.
    """
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    if form == "none":
        store = get_typestore(Stores.ROS1_NOETIC if encoding == "ros1" else Stores.ROS2_HUMBLE)
    else:
        store = get_typestore(Stores.EMPTY)
        if form == "msg":
            store.register(get_types_from_msg(definition, type_name))
        else:
            for part in _idl_parts(definition):
                store.register(get_types_from_idl(part))
    read = store.deserialize_ros1 if encoding == "ros1" else store.deserialize_cdr
    return lambda data: read(data, type_name)


def full_name(type_name: str) -> str:
    """The name with its folder, as ROS 2 has it: nav_msgs/msg/Odometry of nav_msgs/Odometry."""
    package, _, name = type_name.partition("/")
    return type_name if "/" in name or not name else f"{package}/msg/{name}"


def _idl_parts(definition: str) -> list[str]:
    if not definition.startswith(f"{_IDL_BREAK}IDL: "):
        return [definition]
    return [part.partition("\n")[2] for part in definition.split(_IDL_BREAK)[1:]]
