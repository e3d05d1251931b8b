# rosbags 0.11.9, mcap 1.6.0: a ROS 2 bag written with two definitions of one type name stores the first alone, and the other topic is read wrongly
#
# Behaviour: two connections of one bag are given my_msgs/msg/Cmd with the same three float64 fields
#   in another order, each from its own type store. Both connections keep their own definition while
#   writing, and each message is serialised by its own. The file holds one schema, that of the
#   connection that was added first, for both topics, though MCAP could hold two; the values of the
#   second topic arrive under other names. Nothing is raised. A bag of ROS 1 keeps both.
# Guess: what add_connection is given is what the file says of that connection.
# So: no reader can tell; write recordings with different versions of a message into different bags,
#   or MCAP by the library mcap, and compare the schemas in the file with those that were meant.
# Source: schemas are kept by name, https://gitlab.com/ternaris/rosbags/-/blob/master/src/rosbags/rosbag2/storage_mcap.py
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile rosbags==0.11.9 mcap==1.6.0
venv/bin/python - <<'END'
from pathlib import Path
from mcap.reader import make_reader
from rosbags.rosbag1 import Reader as Reader1, Writer as Writer1
from rosbags.rosbag2 import Reader as Reader2, StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
NAME = "my_msgs/msg/Cmd"
def store_of(definition):
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition, NAME))
    return store
STORES = {"/a": store_of("float64 vx\nfloat64 vy\nfloat64 wz\n"), "/b": store_of("float64 wz\nfloat64 vx\nfloat64 vy\n")}
def record(writer, serialise):
    with writer:
        for topic, store in STORES.items():
            connection = writer.add_connection(topic, NAME, typestore=store)
            message = store.types[NAME](vx=1.0, vy=2.0, wz=3.0)
            writer.write(connection, 10**9, getattr(store, serialise)(message, NAME))
def read(reader, deserialise):
    found = {}
    with reader:
        for connection, _, data in reader.messages():
            m = getattr(store_of(connection.msgdef.data), deserialise)(data, NAME)
            found[connection.topic] = (m.vx, m.vy, m.wz)
    print(type(reader).__module__, found)
    return found
right = (1.0, 2.0, 3.0)
record(Writer1(Path("one.bag")), "serialize_ros1")
assert read(Reader1(Path("one.bag")), "deserialize_ros1") == {"/a": right, "/b": right}
for plugin in (StoragePlugin.SQLITE3, StoragePlugin.MCAP):
    path = Path(plugin.name.lower())
    record(Writer2(path, version=9, storage_plugin=plugin), "serialize_cdr")
    assert read(Reader2(path), "deserialize_cdr") == {"/a": right, "/b": (3.0, 1.0, 2.0)}
with open("mcap/mcap.mcap", "rb") as file:
    schemas = make_reader(file).get_summary().schemas
    print("schemas in the MCAP file:", [schema.data.split() for schema in schemas.values()])
    assert len(schemas) == 1
END
