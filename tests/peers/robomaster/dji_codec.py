"""DJI's own client and codec without its connection: `python dji_codec.py FOLDER_OF_THE_PACKAGE TOPIC TOPIC TOPIC`.

The topics carry velocity, attitude and position: on the CAN bus they are the motion controller's, while the package
names those of the intelligent controller, to which it talks by Wi-Fi.

Prints the messages with which DJI's client drives a chassis and asks for telemetry, in hexadecimal under "sent", and
then, for each message in hexadecimal on standard input, what DJI's codec makes of it: a line of JSON each.
"""

import json
import struct
import sys

sys.path.insert(0, sys.argv[1])

from robomaster import chassis, protocol

MOTION_CONTROLLER = protocol.host2byte(3, 6)
PUBLISHER = protocol.host2byte(3, 0)
TOPICS = [int(topic) for topic in sys.argv[2:]]
SUBJECTS = (chassis.VelocitySubject(), chassis.AttiInfoSubject(), chassis.PositionSubject(cs=1))


def tell(**facts: object) -> None:
    print(json.dumps(facts), flush=True)


class Client:
    """In the place of DJI's connection: what is to be sent is printed, and nothing answers."""

    hostbyte = protocol.host2byte(9, 6)

    def send_sync_msg(self, message: protocol.Msg) -> None:
        tell(sent=bytes(message.pack()).hex())


class Robot:
    client, action_dispatcher = Client(), None


def send(receiver: int, proto: protocol.ProtoData) -> None:
    Robot.client.send_sync_msg(protocol.Msg(protocol.host2byte(9, 0), receiver, proto))


def drive() -> None:
    engage = protocol.ProtoChassisSetWorkMode()
    engage._mode = 1
    send(MOTION_CONTROLLER, engage)
    driver = chassis.Chassis(Robot())
    driver.drive_speed(x=0.37, y=-0.21, z=25)
    driver.drive_wheels(w1=60, w2=50, w3=40, w4=30)
    driver.drive_speed(x=0.5, y=0.25, z=-30)


def subscribe() -> None:
    announce = protocol.ProtoSubscribeAddNode()
    announce._node_id = protocol.host2byte(9, 0)
    send(PUBLISHER, announce)
    for number, topic in enumerate(TOPICS):
        wish = protocol.ProtoAddSubMsg()
        wish._node_id, wish._msg_id, wish._sub_freq = protocol.host2byte(9, 0), 20 + number, 50
        wish._sub_data_num, wish._sub_uid_list = 1, [topic]
        send(PUBLISHER, wish)


def unsubscribe() -> None:
    goodbye = protocol.ProtoDelMsg()
    goodbye._node_id, goodbye._msg_id = protocol.host2byte(9, 0), 21
    send(PUBLISHER, goodbye)


def understand(data: bytes) -> None:
    message, rest = protocol.decode_msg(bytearray(data))
    facts: dict[str, object] = {
        "host": [message._sender, message._receiver],
        "sequence": message._seq_id,
        "answer": message.is_ack,
        "need_ack": message._need_ack,
        "command": [message.cmdset, message.cmdid],
        "payload": bytes(message._buf).hex(),
        "rest": len(rest),
    }
    is_push = (message.cmdset, message.cmdid) == (0x48, 0x08)
    if is_push or message.is_ack:
        facts["understood"] = message.unpack_protocol()
    if is_push:
        push = message.get_proto()
        subject = SUBJECTS[push._msg_id - 20]
        subject.decode(push._data_buf)
        facts["subject"], facts["values"] = subject.name, list(subject.data_info())
    if (message.cmdset, message.cmdid) == (0x3F, 0x21):
        facts["speed"] = struct.unpack("<fff", message._buf)
    tell(**facts)


def main() -> None:
    subscribe()
    drive()
    unsubscribe()
    tell(done=True)
    for line in sys.stdin:
        if not line.strip():
            break
        understand(bytes.fromhex(line))


main()
