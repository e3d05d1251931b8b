"""Images that must not play are refused whole, and what plays goes on."""

import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.firmware.image import image_bytes
from tests.firmware.shim_player import ShimPlayer
from tests.firmware.test_playing import WIDE, message_image

GOOD = image_bytes(message_image())


def offered(data, rate_mhz=50_000, room=1 << 24):
    """Name of the result; a refused image must leave the core silent."""
    player = ShimPlayer(rate_mhz, WIDE, room=room)
    result = player.offer(data)
    if result != player.lib.MTM_OK:
        assert player.tick(0, (7, 8, 9)) == [7, 8, 9]
        assert player.counts.refused_images == 1
    names = [name for name in dir(player.lib) if name.startswith(("MTM_OK", "MTM_BAD", "MTM_IMAGE_"))]
    results = {getattr(player.lib, name): name for name in names if not name.endswith(("BYTES", "IMAGE_VERSION"))}
    return results[result]


def with_field(layout, offset, value):
    """The good image with one header field replaced and its CRC-32 made right again."""
    data = bytearray(GOOD[:-4])
    struct.pack_into(layout, data, offset, value)
    return bytes(data) + struct.pack("<I", zlib.crc32(data))


def test_the_good_image_is_taken():
    assert offered(GOOD) == "MTM_OK"


@pytest.mark.parametrize("size", [0, 1, 4, 87, 91, 92, 200, len(GOOD) - 1])
def test_a_truncated_image_is_refused(size):
    assert offered(GOOD[:size]) == "MTM_IMAGE_TRUNCATED"


def test_an_image_with_a_byte_too_many_is_refused():
    assert offered(GOOD + b"\0") == "MTM_IMAGE_TRUNCATED"


def test_every_flipped_bit_is_refused():
    data = bytearray(GOOD)
    for bit in range(8 * len(data)):
        data[bit >> 3] ^= 1 << (bit & 7)
        player = ShimPlayer(50_000, WIDE)
        assert player.offer(bytes(data)) != player.lib.MTM_OK, bit
        data[bit >> 3] ^= 1 << (bit & 7)


@given(data=st.binary(max_size=300))
def test_arbitrary_bytes_are_refused(data):
    assert offered(data) != "MTM_OK"


@pytest.mark.parametrize(
    ("layout", "offset", "value", "result"),
    [
        ("<B", 0, ord("m"), "MTM_IMAGE_FOREIGN"),
        ("<H", 4, 0, "MTM_IMAGE_VERSION_UNKNOWN"),
        ("<H", 4, 2, "MTM_IMAGE_VERSION_UNKNOWN"),
        ("<B", 6, 0, "MTM_IMAGE_INVALID"),
        ("<B", 6, 1, "MTM_IMAGE_INVALID"),
        ("<B", 6, 7, "MTM_IMAGE_INVALID"),
        ("<B", 6, 11, "MTM_IMAGE_INVALID"),
        ("<B", 7, 2, "MTM_IMAGE_INVALID"),
        ("<I", 8, len(GOOD) + 2, "MTM_IMAGE_TRUNCATED"),
        ("<I", 8, 0xFFFFFFFF, "MTM_IMAGE_TOO_LARGE"),
        ("<I", 12, 49_999, "MTM_IMAGE_WRONG_RATE"),
        ("<I", 16, 0, "MTM_IMAGE_INVALID"),
        ("<I", 16, 59, "MTM_IMAGE_INVALID"),
        ("<I", 16, 1 << 20, "MTM_IMAGE_INVALID"),
        ("<I", 16, (1 << 20) + 1, "MTM_IMAGE_INVALID"),
        ("<I", 20, 0, "MTM_IMAGE_INVALID"),
        ("<I", 20, 2, "MTM_IMAGE_INVALID"),
        ("<I", 20, 4097, "MTM_IMAGE_INVALID"),
        ("<I", 48, 0, "MTM_IMAGE_INVALID"),
        ("<I", 48, (1 << 30) + 1, "MTM_IMAGE_INVALID"),
        ("<I", 52, 0, "MTM_IMAGE_INVALID"),
        ("<I", 52, (1 << 30) + 1, "MTM_IMAGE_INVALID"),
        ("<I", 64, 5, "MTM_IMAGE_INVALID"),
    ],
)
def test_a_wrong_field_under_a_right_checksum_is_refused(layout, offset, value, result):
    assert offered(with_field(layout, offset, value)) == result


@pytest.mark.parametrize(("layout", "offset", "value"), [("<I", 48, 1 << 30), ("<I", 52, 1 << 30), ("<I", 68, 1)])
def test_a_field_at_the_edge_of_its_range_is_taken(layout, offset, value):
    assert offered(with_field(layout, offset, value)) == "MTM_OK"


def test_fields_for_the_record_do_not_matter_to_the_device():
    assert offered(with_field("<Q", 24, 2**64 - 1)) == "MTM_OK"
    assert offered(with_field("<16s", 72, b"not a tag at all")) == "MTM_OK"


def test_an_image_larger_than_the_board_allows_is_refused():
    assert offered(GOOD, room=len(GOOD)) == "MTM_OK"
    assert offered(GOOD, room=len(GOOD) - 1) == "MTM_IMAGE_TOO_LARGE"


def test_an_image_for_another_rate_is_refused():
    assert offered(GOOD, rate_mhz=100_000) == "MTM_IMAGE_WRONG_RATE"


def test_a_refused_image_leaves_what_plays_alone():
    undisturbed, player = (ShimPlayer(50_000, WIDE) for _ in range(2))
    for each in (undisturbed, player):
        each.offer(GOOD)
        each.tick(0, (0, 0, 0))
    assert player.offer(GOOD[:-1]) == player.lib.MTM_IMAGE_TRUNCATED
    played = [[each.tick(20_000 * tick, (0, 0, 0)) for tick in range(1, 130)] for each in (undisturbed, player)]
    np.testing.assert_array_equal(*played)
