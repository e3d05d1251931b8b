import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.framing.payload import bits_of_payload, payload_of_bits
from tests.onboard.protocol.framing.framed import framings, payloads

NUMBER, BYTES, TEXT = Framing("integer", 8), Framing("bytes", 24), Framing("text", 24)


@given(st.data())
def test_every_payload_is_read_back(data):
    framing = data.draw(framings())
    payload = data.draw(payloads(framing))
    bits = bits_of_payload(payload, framing)
    assert 0 <= bits < 1 << (framing.length_bits + framing.payload_bits)
    assert payload_of_bits(bits, framing) == payload


@pytest.mark.parametrize(
    ("framing", "payload", "bits"),
    [
        (NUMBER, 0, 0),
        (NUMBER, 255, 255),
        (BYTES, b"\x01", 0x0_010000),
        (BYTES, b"\x01\x02", 0x1_010200),
        (BYTES, b"\x01\x02\x03", 0x2_010203),
        (TEXT, "é", 0x1_C3A900),
        (Framing("bytes", 8), b"\xff", 0xFF),
    ],
)
def test_the_length_less_one_comes_first_and_zeros_last(framing, payload, bits):
    assert bits_of_payload(payload, framing) == bits
    assert payload_of_bits(bits, framing) == payload


@pytest.mark.parametrize(
    ("framing", "bits"),
    [
        (BYTES, 0x3_010203),  # a length of four in a field for three
        (BYTES, 0x0_010100),  # something in the padding
        (BYTES, 0x1_010101),
        (TEXT, 0x0_FF0000),  # no UTF-8
        (TEXT, 0x0_1B0000),  # not printable
    ],
)
def test_bits_that_no_payload_is_written_as_are_refused(framing, bits):
    assert payload_of_bits(bits, framing) is None


@pytest.mark.parametrize(
    ("framing", "payload", "says"),
    [
        (NUMBER, 256, r"8 bits, 0 to 255"),
        (NUMBER, -1, "does not fit"),
        (NUMBER, True, "whole numbers, not bool"),
        (NUMBER, b"a", "whole numbers, not bytes"),
        (NUMBER, 1.0, "whole numbers, not float"),
        (BYTES, "a", "are bytes, not text"),
        (BYTES, b"", "is empty; this scheme carries 1 to 3 bytes"),
        (BYTES, b"abcd", "is 4 bytes long; this scheme carries 1 to 3 bytes"),
        (TEXT, 1, "are text, not a number"),
        (TEXT, "abcd", "is 4 bytes long"),
        (TEXT, "a\n", "cannot be printed"),
    ],
)
def test_a_payload_of_another_kind_or_size_is_refused(framing, payload, says):
    with pytest.raises(MtmError, match=says):
        bits_of_payload(payload, framing)
