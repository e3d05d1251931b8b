import json
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mtm_onboard.links.duml import MAX_LENGTH, OVERHEAD, Message, Parser, crc8, crc16, encode, segment

# Frames written by DJI's SDK and three open libraries, or captured from a real robot; each names its source.
GOLDEN = json.loads(Path(__file__).with_name("golden_duml.json").read_text(encoding="utf-8"))
HOST = st.integers(0, 255)
MESSAGES = st.builds(
    Message,
    sender=HOST,
    receiver=HOST,
    sequence=st.integers(0, 65_535),
    attributes=HOST,
    cmdset=HOST,
    cmdid=HOST,
    payload=st.binary(max_size=60),
)
NEXT = Message(sender=0x09, receiver=0xC3, sequence=7, attributes=0x40, cmdset=0x3F, cmdid=0x19, payload=b"\x01")


def golden_message(frame):
    return Message(
        sender=frame["sender"],
        receiver=frame["receiver"],
        sequence=frame["sequence"],
        attributes=frame["attributes"],
        cmdset=frame["cmdset"],
        cmdid=frame["cmdid"],
        payload=bytes.fromhex(frame["payload"]),
    )


def fed_in_portions(data, cuts):
    parser, messages, start = Parser(), [], 0
    for end in [*sorted(cuts), len(data)]:
        messages += parser.feed(data[start:end])
        start = end
    return messages


@pytest.mark.parametrize("frame", GOLDEN, ids=lambda frame: frame["name"])
def test_every_published_frame_is_written_and_read_byte_for_byte(frame):
    data = bytes.fromhex(frame["bytes"])
    assert encode(golden_message(frame)) == data
    assert Parser().feed(data) == [golden_message(frame)]


def test_the_checksums_have_their_catalogue_values():
    assert crc8(b"123456789") == 0xFB
    assert crc16(b"123456789") == 0x7109
    assert (crc8(b""), crc16(b"")) == (0x77, 0x3692)


@pytest.mark.parametrize(("length", "expected"), [(13, 0x33), (25, 0xE4), (155, 0x5A), (300, 0x68), (1023, 0xD9)])
def test_the_header_of_a_length_has_the_published_checksum(length, expected):
    assert (
        encode(
            Message(sender=9, receiver=3, sequence=0, attributes=0, cmdset=0, cmdid=0, payload=bytes(length - OVERHEAD))
        )[3]
        == expected
    )


@given(MESSAGES)
def test_a_message_survives_the_way_there_and_back(message):
    assert Parser().feed(encode(message)) == [message]


@given(st.lists(MESSAGES, max_size=4), st.data())
def test_the_way_a_stream_is_cut_does_not_matter(messages, data):
    stream = b"".join(map(encode, messages))
    cuts = data.draw(st.lists(st.integers(0, len(stream)), max_size=20))
    assert fed_in_portions(stream, cuts) == messages


@given(st.binary(max_size=80), st.binary(max_size=80), MESSAGES)
@example(encode(NEXT)[:9], encode(NEXT)[:3], NEXT)
@example(
    encode(Message(sender=0, receiver=0, sequence=0, attributes=0, cmdset=0, cmdid=0, payload=bytes(1010)))[:4],
    b"",
    NEXT,
)
def test_garbage_between_messages_costs_no_message(before, between, message):
    messages = Parser().feed(before + encode(message) + between + encode(NEXT))
    assert message in messages
    assert messages[-1] == NEXT


@given(MESSAGES, st.data())
def test_one_flipped_bit_never_loses_the_message_after(message, data):
    broken = bytearray(encode(message))
    bit = data.draw(st.integers(0, 8 * len(broken) - 1))
    broken[bit // 8] ^= 1 << bit % 8
    parser = Parser()
    assert parser.feed(broken + encode(NEXT)) == [NEXT]
    assert parser.dropped_bytes == len(broken)
    assert parser.header_failures + parser.checksum_failures > 0 or bit < 8


@given(MESSAGES, st.data())
def test_a_message_that_ends_early_costs_only_itself(message, data):
    whole = encode(message)
    kept = data.draw(st.integers(0, len(whole) - 1))
    assert Parser().feed(whole[:kept] + encode(NEXT)) == [NEXT]


def test_a_header_sound_by_accident_hides_no_message():
    parser = Parser()
    accident = encode(Message(sender=0, receiver=0, sequence=0, attributes=0, cmdset=0, cmdid=0, payload=bytes(900)))[
        :4
    ]
    assert parser.feed(accident + encode(NEXT)[:6]) == []
    assert parser.feed(encode(NEXT)[6:]) == [NEXT]
    assert parser.dropped_bytes == 4


@given(st.lists(st.binary(min_size=1, max_size=300), max_size=20))
def test_the_parser_never_keeps_a_whole_longest_message(portions):
    parser, fed = Parser(), 0
    parser.feed(
        encode(Message(sender=0, receiver=0, sequence=0, attributes=0, cmdset=0, cmdid=0, payload=bytes(1010)))[:4]
    )
    for portion in portions:
        parser.feed(portion)
        fed += len(portion)
    assert 4 + fed - parser.dropped_bytes < MAX_LENGTH


def test_an_aligned_message_fills_frames_of_eight_bytes():
    message = golden_message(next(f for f in GOLDEN if f["name"] == "CAN speed(0.5,0,0) c9->c3 noack seq2"))
    frames = ["551904e4c9c30200", "003f210000003f00", "00000000000000a2", "1f"]
    assert [frame.hex() for frame in segment(encode(message))] == frames


def test_a_packed_stream_is_read_across_frames():
    # What the Cambridge library's stream buffer puts on the bus: work mode, heartbeat, wheel speed, without a flush.
    frames = (
        "550E046609C30200 003F1901CD83551B 047509030200003F 6000042000010040 000210040300045F "
        "8D551504A9C9C303 00003F201E000000 00000000D94F551B 047509030300003F"
    )
    parser = Parser()
    messages = [message for frame in frames.split() for message in parser.feed(bytes.fromhex(frame))]
    assert [(message.cmdid, message.sequence) for message in messages] == [(0x19, 2), (0x60, 2), (0x20, 3)]
    assert parser.dropped_bytes == 0


@pytest.mark.parametrize(
    "message",
    [
        Message(sender=0, receiver=0, sequence=0, attributes=0, cmdset=0, cmdid=0, payload=bytes(1011)),
        Message(sender=256, receiver=0, sequence=0, attributes=0, cmdset=0, cmdid=0),
        Message(sender=0, receiver=0, sequence=-1, attributes=0, cmdset=0, cmdid=0),
    ],
)
def test_what_does_not_fit_the_format_is_refused(message):
    with pytest.raises(ValueError, match=r"limit of 1010|does not fit"):
        encode(message)


def test_an_answer_goes_back_under_the_same_number():
    assert NEXT.answer(b"\x00") == Message(
        sender=0xC3, receiver=0x09, sequence=7, attributes=0x80, cmdset=0x3F, cmdid=0x19, payload=b"\x00"
    )
