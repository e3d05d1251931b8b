import sys
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.framing import Frame, Framing, decode_frame, encode_frame
from mtm_onboard.protocol.framing.framing import layout_of
from mtm_onboard.protocol.keystream import stream
from tests.onboard.protocol.framing.framed import (
    FAKE_SECRET,
    OTHER_SECRET,
    framed_scheme,
    payloads,
    plain_row,
    schemes,
)

TAGGED = Framing("integer", 16, number_bits=8, check="tag", check_bits=24)
CODED = replace(TAGGED, code="reed-solomon")
CHECKED = ("crc", "tag")


@given(schemes(), st.data())
def test_every_frame_is_read_back(scheme, data):
    payload = data.draw(payloads(scheme.framing))
    number, epoch = data.draw(st.integers(0, 2**20)), data.draw(st.integers(0, 2**63))
    symbols = encode_frame(payload, scheme, FAKE_SECRET, number=number, epoch=epoch)
    assert len(symbols) == scheme.message_symbols
    assert all(0 <= symbol < scheme.alphabet_size for symbol in symbols)
    expected = Frame(payload, number % 2**scheme.framing.number_bits)
    assert decode_frame(symbols, scheme, FAKE_SECRET, epoch=epoch) == expected


def read_or_none(symbols, scheme, secret=FAKE_SECRET, epoch=0):
    try:
        return decode_frame(symbols, scheme, secret, epoch=epoch)
    except MtmError:
        return None


@given(schemes(checks=CHECKED), st.data())
def test_a_changed_symbol_is_corrected_or_refused(scheme, data):
    payload = data.draw(payloads(scheme.framing))
    symbols = list(encode_frame(payload, scheme, FAKE_SECRET))
    place = data.draw(st.integers(0, len(symbols) - 1))
    symbols[place] = (symbols[place] + data.draw(st.integers(1, scheme.alphabet_size - 1))) % scheme.alphabet_size
    read = read_or_none(symbols, scheme)
    coded = scheme.framing.code == "reed-solomon"
    assert read == Frame(payload, 0) or (read is None and not coded)


@given(schemes(checks=("none",), codes=("reed-solomon",)), st.data())
def test_half_the_parity_may_be_wrong_and_all_of_it_missing(scheme, data):
    layout = layout_of(scheme.framing, scheme.alphabet_size, scheme.message_symbols)
    payload = data.draw(payloads(scheme.framing))
    symbols = encode_frame(payload, scheme, FAKE_SECRET)
    places = data.draw(st.permutations(range(layout.code_symbols)))
    wrong, missing = list(symbols), list(symbols)
    for place in places[: layout.parity // 2]:
        wrong[place * layout.group] ^= 1
    for place in places[: layout.parity]:
        missing[place * layout.group] = None
    assert decode_frame(wrong, scheme, FAKE_SECRET) == Frame(payload, 0)
    assert decode_frame(missing, scheme, FAKE_SECRET) == Frame(payload, 0)


def test_a_tagged_frame_needs_its_own_key_and_epoch():
    scheme = framed_scheme(CODED)
    symbols = encode_frame(4711, scheme, FAKE_SECRET, number=300, epoch=7)
    assert decode_frame(symbols, scheme, FAKE_SECRET, epoch=7) == Frame(4711, 44)
    for secret, epoch in ((OTHER_SECRET, 7), (FAKE_SECRET, 8)):
        with pytest.raises(MtmError, match="no frame of this key and epoch"):
            decode_frame(symbols, scheme, secret, epoch=epoch)


def test_the_frame_is_number_payload_tag_and_filler():
    scheme = plain_row(TAGGED, 16, 14)
    tag = stream(FAKE_SECRET, "tag", (9, 0xAB, 0x1234), 3)
    symbols = encode_frame(0x1234, scheme, FAKE_SECRET, number=0x5AB, epoch=9)
    assert symbols == (*(int(digit, 16) for digit in "ab1234" + tag.hex()), 0, 0)


def test_the_examples_of_the_documentation_hold():
    tagged = plain_row(CODED, 16, 17)
    symbols = encode_frame(4660, tagged, FAKE_SECRET, number=1451, epoch=9)
    assert "".join(f"{symbol:x}" for symbol in symbols) == "ab1234" + "5249d9" + "1659" + "0"
    checked = plain_row(Framing("text", 24, check="crc", check_bits=16), 16, 13)
    symbols = encode_frame("hé", checked, FAKE_SECRET, epoch=9)
    assert "".join(f"{symbol:x}" for symbol in symbols) == "9a30ea4961800"


def test_short_bytes_are_padded_after_their_length():
    scheme = plain_row(Framing("bytes", 4 * 8), 4, 17)
    assert encode_frame(b"\xe4", scheme, FAKE_SECRET) == (0, 3, 2, 1, 0, *[0] * 12)
    assert encode_frame(b"\x00\x00\x00\x00", scheme, FAKE_SECRET)[0] == 3


def test_the_parity_of_a_known_codeword():
    # GF(16), x^4 + x + 1, roots 1 and 2: the generator is x^2 + 3 x + 2.
    scheme = plain_row(Framing("integer", 4, code="reed-solomon"), 16, 3)
    assert encode_frame(1, scheme, FAKE_SECRET) == (1, 3, 2)


def test_symbols_that_were_not_seen_need_a_code():
    scheme = framed_scheme(TAGGED)
    with pytest.raises(MtmError, match="1 symbols were not seen"):
        decode_frame([None, *encode_frame(1, scheme, FAKE_SECRET)[1:]], scheme, FAKE_SECRET)


def test_too_many_errors_are_refused():
    scheme = framed_scheme(CODED)
    with pytest.raises(MtmError, match=r"(no frame|can correct|always zero)"):
        decode_frame([symbol ^ 1 for symbol in encode_frame(1, scheme, FAKE_SECRET)], scheme, FAKE_SECRET)


def test_a_scheme_without_framing_sends_plain_numbers():
    scheme = framed_scheme(None, counts=(1, 1, 1, 1))
    assert encode_frame(0b11_10_01_00, scheme, FAKE_SECRET) == (3, 2, 1, 0)
    assert decode_frame((3, 2, 1, 0), scheme, FAKE_SECRET) == Frame(0b11_10_01_00, 0)
    with pytest.raises(MtmError, match="plain numbers"):
        encode_frame("text", scheme, FAKE_SECRET)
    with pytest.raises(MtmError, match="spell no message"):
        decode_frame((3, 2, None, 0), scheme, FAKE_SECRET)
    with pytest.raises(MtmError, match="3 symbols given"):
        decode_frame((3, 2, 1), scheme, FAKE_SECRET)


@pytest.mark.parametrize(
    ("framing", "payload", "words"),
    [
        (Framing("integer", 8), 256, "8 bits, 0 to 255"),
        (Framing("integer", 8), -1, "does not fit"),
        (Framing("integer", 8), "7", "whole numbers, not text"),
        (Framing("integer", 8), True, "whole numbers, not bool"),
        (Framing("bytes", 16), b"", "the message is empty; this scheme carries 1 to 2 bytes"),
        (Framing("bytes", 16), b"abc", "the message is 3 bytes long"),
        (Framing("bytes", 16), 5, "bytes, not a number"),
        (Framing("text", 16), "", "empty"),
        (Framing("text", 16), "é€", "5 bytes long"),
        (Framing("text", 16), b"a", "text, not bytes"),
        (Framing("text", 16), "\x1b", "cannot be printed"),
        (Framing("text", 16), "\ud800", "cannot be printed"),
    ],
)
def test_a_payload_that_cannot_be_sent_is_refused(framing, payload, words):
    with pytest.raises(MtmError, match=words):
        encode_frame(payload, framed_scheme(framing), FAKE_SECRET)


def test_a_negative_number_is_refused():
    with pytest.raises(MtmError, match="count from 0"):
        encode_frame(1, framed_scheme(TAGGED), FAKE_SECRET, number=-1)


@pytest.mark.parametrize(
    "content",
    [b"\x00a\x80", b"\x01\xff\xff", b"\x00\x1b\x00", b"\x03aa"],
    ids=["padding", "UTF-8", "control", "length"],
)
def test_bits_that_spell_no_text_are_refused(content):
    # Three bytes of text: 2 bits of length, then 24 of text; symbols of one bit.
    bits = f"{content[0]:02b}" + "".join(f"{byte:08b}" for byte in content[1:].ljust(3, b"\0"))
    with pytest.raises(MtmError, match="no frame"):
        decode_frame([int(bit) for bit in bits], plain_row(Framing("text", 24), 2, 26), FAKE_SECRET)


def test_a_robot_needs_no_package_that_corrects(monkeypatch):
    frame = encode_frame(1, framed_scheme(CODED), FAKE_SECRET)
    monkeypatch.setitem(sys.modules, "reedsolo", None)
    assert encode_frame(1, framed_scheme(CODED), FAKE_SECRET) == frame
    with pytest.raises(MtmError, match=r"install it with: pip install 'messages-through-motion\[audit\]'"):
        decode_frame(frame, framed_scheme(CODED), FAKE_SECRET)


def test_epoch_and_number_are_zero_unless_they_are_given():
    scheme = framed_scheme(CODED)
    symbols = encode_frame(7, scheme, FAKE_SECRET)
    assert symbols == encode_frame(7, scheme, FAKE_SECRET, number=0, epoch=0)
    assert decode_frame(symbols, scheme, FAKE_SECRET) == Frame(7, 0)
