# rosbags 0.11.9: AnyReader decodes every recording with one definition of a type name, and which one depends on the order of paths
#
# Behaviour: two recordings hold my_msgs/msg/Cmd with the same three float64 fields in another
#   order, (vx, vy, wz) and (wz, vx, vy), say before and after a change of the message. Read alone
#   each is right. Read together, the definition of the path given last decodes both, and the values
#   of the other recording arrive under other names. Nothing is raised, though each connection keeps
#   its own definition and its own hash.
# Guess: a message is decoded by the definition stored beside it, and a clash of names is an error.
# So: read recordings one by one, or build a type store for each connection from its own msgdef.
# Source: types of all readers are merged into one type store in
#   https://gitlab.com/ternaris/rosbags/-/blob/master/src/rosbags/highlevel/anyreader.py
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile rosbags==0.11.9
venv/bin/python - <<'END'
from pathlib import Path
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
NAME = "my_msgs/msg/Cmd"
def record(path, definition):
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition, NAME))
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/cmd", NAME, typestore=store)
        message = store.types[NAME](vx=1.0, vy=2.0, wz=3.0)
        writer.write(connection, 10**9, store.serialize_cdr(message, NAME))
    return path
old = record(Path("old"), "float64 vx\nfloat64 vy\nfloat64 wz\n")
new = record(Path("new"), "float64 wz\nfloat64 vx\nfloat64 vy\n")
def read(*paths):
    with AnyReader(list(paths)) as reader:
        found, hashes = {}, {c.digest for c in reader.connections}
        for connection, _, raw in reader.messages():
            m = reader.deserialize(raw, connection.msgtype)
            found[connection.digest] = (m.vx, m.vy, m.wz)
    print([p.name for p in paths], "->", sorted(found.values()), f"({len(hashes)} definitions)")
    return sorted(found.values())
right = (1.0, 2.0, 3.0)
assert read(old) == read(new) == [right]
assert read(old, new) == [right, (2.0, 3.0, 1.0)]
assert read(new, old) == [right, (3.0, 1.0, 2.0)]
END
