from unittest.mock import patch

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import Channel, Key, MtmError
from mtm_onboard.protocol.framing import Framing, decode_frame, frame_order, symbols_of_number
from mtm_onboard.runtime import message as module
from mtm_onboard.runtime.message import FramedMessage, PlainMessage, content_from_table, message_of
from tests.onboard.schemes import FAKE_SECRET, small_scheme

# 24 symbols on two channels; 12 s at 50 Hz, so that a day has 7,200 slots.
CHANNELS = (Channel("a", "a", ("vx",), 12, 0.1), Channel("b", "b", ("vx",), 12, 0.1))
TEXT = Framing("text", 16, number_bits=3, check="tag", check_bits=16, interleave=True)
DAY = 7_200


def key_of(framing: Framing | None = TEXT, **changes) -> Key:
    changes = dict(schedule="rolling", epoch=4, message_ticks=600, channels=CHANNELS) | changes
    return Key("fake-key", FAKE_SECRET, small_scheme(framing=framing, **changes))


def in_frame_order(played, scheme, slot) -> list[int]:
    frame = [0] * len(played)
    for position, place in enumerate(frame_order(scheme, slot).tolist()):
        frame[place] = played[position]
    return frame


@given(st.integers(0, 20 * DAY), st.integers(0, 20))
def test_a_framed_message_has_the_epoch_of_its_day(slot, number):
    key = key_of()
    played = FramedMessage("hi", key, number).symbols(slot)
    frame = decode_frame(in_frame_order(played, key.scheme, slot), key.scheme, key.secret, epoch=4 + slot // DAY)
    assert (frame.payload, frame.number) == ("hi", number % 8)


def test_the_tag_changes_at_midnight_and_only_then():
    key = key_of(Framing("text", 16, check="tag", check_bits=16))
    message = FramedMessage("hi", key)
    days = [message.symbols(slot) for slot in range(DAY - 3, DAY + 3)]
    assert len(set(days[:3])) == len(set(days[3:])) == 1
    assert days[2] != days[3]
    assert message.symbols(0) == days[0]


def test_a_fixed_message_is_the_same_in_every_slot():
    key = key_of(schedule="fixed")
    message = FramedMessage("hi", key)
    assert message.symbols(0) == message.symbols(3 * DAY + 1)
    frame = decode_frame(in_frame_order(message.symbols(9), key.scheme, 9), key.scheme, key.secret, epoch=4)
    assert frame.payload == "hi"


def test_a_frame_is_encoded_once_a_day():
    message = FramedMessage("hi", key_of())
    with patch.object(module, "encode_frame", wraps=module.encode_frame) as encode:
        for slot in (0, 1, 2, DAY, DAY + 1, 0):
            message.symbols(slot)
    # The first day's was made with the message.
    assert encode.call_count == 2


def test_messages_count_from_zero():
    key = key_of()
    assert (PlainMessage((0,) * 24).number, FramedMessage("hi", key).number) == (0, 0)
    played = FramedMessage("hi", key).symbols(0)
    assert decode_frame(in_frame_order(played, key.scheme, 0), key.scheme, key.secret, epoch=4).number == 0
    assert message_of("hi", key).number == 0


def test_an_interleaved_message_differs_from_slot_to_slot():
    message = FramedMessage("hi", key_of())
    assert message.symbols(10) != message.symbols(11)


def test_a_scheme_without_framing_carries_numbers_and_symbols():
    key = key_of(None)
    assert message_of(77, key, 2) == PlainMessage(symbols_of_number(77, key.scheme), 2, 77)
    assert message_of((1,) * 24, key).symbols(5) == (1,) * 24


@pytest.mark.parametrize(
    ("content", "framing", "sentence"),
    [
        ("hi", None, "plain numbers and no text"),
        (b"hi", None, "plain numbers and no text"),
        (True, None, "plain numbers and no text"),
        (1 << 48, None, "does not fit"),
        ((0, 1), None, "2 symbols given"),
        ((0,) * 24, TEXT, "symbols cannot be given"),
        (7, TEXT, "text, not a number"),
        ("far too long", TEXT, "carries 1 to 2 bytes"),
        (-1, Framing("integer", 8), "does not fit"),
    ],
)
def test_content_that_the_scheme_does_not_carry_is_refused(content, framing, sentence):
    with pytest.raises(MtmError, match=sentence):
        message_of(content, key_of(framing))


@pytest.mark.parametrize(
    ("table", "content"),
    [
        ({"number": 7}, 7),
        ({"text": "hi"}, "hi"),
        ({"hex": "00ff"}, b"\x00\xff"),
        ({"symbols": [1, 2]}, (1, 2)),
    ],
)
def test_a_request_s_content_is_read(table, content):
    assert content_from_table(table) == content


@pytest.mark.parametrize(
    "table",
    [
        {}, {"number": 1, "text": "a"}, {"number": True}, {"number": 1.5}, {"text": 7}, {"hex": "0"}, {"hex": 12},
        {"symbols": "12"}, {"symbols": [1, True]}, {"symbols": [[1]]}, {"file": "a"}, {"number": None},
    ],
)  # fmt: skip
def test_any_other_content_is_refused_in_one_sentence(table):
    with pytest.raises(MtmError, match="give"):
        content_from_table(table)
