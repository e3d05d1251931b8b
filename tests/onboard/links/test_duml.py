import json
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mtm_onboard.links.duml import MAX_LENGTH, OVERHEAD, Message, Parser, crc8, crc16, encode, segment

# Frames written by DJI's SDK and three open libraries, or captured from a real robot; each names its source.
GOLDEN = json.loads(Path(__file__).with_name("golden_duml.json").read_text(encoding="utf-8"))
HOST = st.integers(0, 255)
MESSAGES = st.builds(Message, HOST, HOST, st.integers(0, 65_535), HOST, HOST, HOST, st.binary(max_size=60))
NEXT = Message(0x09, 0xC3, 7, 0x40, 0x3F, 0x19, b"\x01")


def golden_message(frame):
    return Message(
        frame["sender"],
        frame["receiver"],
        frame["sequence"],
        frame["attributes"],
        frame["cmdset"],
        frame["cmdid"],
        bytes.fromhex(frame["payload"]),
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
    assert encode(Message(9, 3, 0, 0, 0, 0, bytes(length - OVERHEAD)))[3] == expected


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
@example(encode(Message(0, 0, 0, 0, 0, 0, bytes(1010)))[:4], b"", NEXT)
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
    accident = encode(Message(0, 0, 0, 0, 0, 0, bytes(900)))[:4]
    assert parser.feed(accident + encode(NEXT)[:6]) == []
    assert parser.feed(encode(NEXT)[6:]) == [NEXT]
    assert parser.dropped_bytes == 4


@given(st.lists(st.binary(min_size=1, max_size=300), max_size=20))
def test_the_parser_never_keeps_a_whole_longest_message(portions):
    parser, fed = Parser(), 0
    parser.feed(encode(Message(0, 0, 0, 0, 0, 0, bytes(1010)))[:4])
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
    "message", [Message(0, 0, 0, 0, 0, 0, bytes(1011)), Message(256, 0, 0, 0, 0, 0), Message(0, 0, -1, 0, 0, 0)]
)
def test_what_does_not_fit_the_format_is_refused(message):
    with pytest.raises(ValueError, match=r"limit of 1010|does not fit"):
        encode(message)


def test_an_answer_goes_back_under_the_same_number():
    assert NEXT.answer(b"\x00") == Message(0xC3, 0x09, 7, 0x80, 0x3F, 0x19, b"\x00")
