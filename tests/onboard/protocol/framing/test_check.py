import binascii

import pytest

from mtm_onboard.protocol.framing.check import check_value, crc
from mtm_onboard.protocol.framing.framing import CRC_POLYNOMIALS, Framing
from mtm_onboard.protocol.keystream import stream
from tests.onboard.protocol.framing.framed import FAKE_SECRET

DIGITS = int.from_bytes(b"123456789", "big")


# Published check values: CRC-16/IBM-3740, CRC-32/MPEG-2, and CRC-64/WE before its final inversion.
@pytest.mark.parametrize(
    ("bits", "value"), [(16, 0x29B1), (32, 0x0376E6E7), (64, 0x62EC59E3F1A4F00A ^ 0xFFFF_FFFF_FFFF_FFFF)]
)
def test_the_crc_is_the_published_one(bits, value):
    assert crc(DIGITS, 72, bits) == value


@pytest.mark.parametrize("bits", sorted(CRC_POLYNOMIALS))
def test_every_burst_as_long_as_the_crc_is_noticed(bits):
    whole = crc(DIGITS, 72, bits)
    for start in range(72 - 16):
        assert all(crc(DIGITS ^ burst << start, 72, bits) != whole for burst in (1, 3, 0x8001, 0xFFFF))


def test_the_tag_takes_the_body_in_words_most_significant_first():
    framing = Framing("bytes", 128, check="tag", check_bits=20)
    body = 15 << 128 | int.from_bytes(bytes(range(16)), "big")
    words = (15, int.from_bytes(bytes(range(8)), "big"), int.from_bytes(bytes(range(8, 16)), "big"))
    expected = int.from_bytes(stream(FAKE_SECRET, "tag", (3, 0, *words), 8), "big") >> 44
    assert check_value(0, body, framing, FAKE_SECRET, 3) == expected


def test_the_crc_covers_the_epoch_and_needs_no_key():
    framing = Framing("integer", 8, check="crc", check_bits=16)
    values = {check_value(0, 5, framing, FAKE_SECRET, epoch) for epoch in range(100)}
    assert len(values) == 100
    assert check_value(0, 5, framing, bytes(32), 0) == check_value(0, 5, framing, FAKE_SECRET, 0)


@pytest.mark.parametrize(
    ("epoch", "number", "body"), [(0, 0, 0), (1, 2, 3), (20_000, 0xAB, 0x1234), (2**63, 255, 65_535)]
)
def test_a_crc_runs_over_epoch_number_and_body(epoch, number, body):
    framing = Framing("integer", 16, number_bits=8, check="crc", check_bits=16)
    content = epoch.to_bytes(8, "big") + bytes([number]) + body.to_bytes(2, "big")
    # The standard library's CRC of the same polynomial.
    assert check_value(number, body, framing, FAKE_SECRET, epoch) == binascii.crc_hqx(content, 0xFFFF)


def test_a_frame_without_a_check_has_none():
    assert check_value(0, 5, Framing("integer", 8), FAKE_SECRET, 7) == 0
