"""Sealed images: the device takes those of its own key and channel, and none a second time."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.firmware.image import ONE, image_bytes
from mtm_onboard.firmware.seal import parse_sealed, seal_of, sealed
from mtm_onboard.protocol import MtmError
from tests.firmware.shim_player import ShimPlayer
from tests.firmware.test_playing import WIDE, message_image

DEVICE_KEY = b"a device's fake key, only a test"
OTHER_KEY = b"another device's fake key, a test"[:32]
IMAGE = message_image()


def seal(channel=3, counter=7, limits=(0.5, 0.5, 0.5), key=DEVICE_KEY, image=IMAGE):
    return sealed(image, seal_of(channel, counter, limits), key)


def trusting(channel=3, counter=0, key=DEVICE_KEY):
    player = ShimPlayer(50_000, WIDE)
    player.lib.mtm_shim_trust(player.shim, key, channel, counter)
    return player


def offered(data, player=None):
    """Name of the result; a refused image leaves the core silent."""
    player = player or trusting()
    result = player.offer(data)
    if result != player.lib.MTM_OK:
        assert player.tick(0, (7, 8, 9)) == [7, 8, 9]
    names = [name for name in dir(player.lib) if name.startswith(("MTM_OK", "MTM_IMAGE_"))]
    results = {getattr(player.lib, name): name for name in names if not name.endswith(("BYTES", "IMAGE_VERSION"))}
    return results[result]


@pytest.mark.parametrize("ticks", range(60, 340, 4))
def test_device_and_program_agree_on_the_seal_of_any_length(ticks):
    # Among these are images that end on, before and after the edge of the sponge's block.
    image = message_image(ticks=ticks)
    assert offered(seal(image=image)) == "MTM_OK"


def test_a_sealed_image_plays_as_the_image_itself():
    bare, device = ShimPlayer(50_000, WIDE), trusting()
    bare.offer(IMAGE)
    device.offer(seal())
    for tick in range(130):
        assert device.tick(20_000 * tick, (5, 6, 7)) == bare.tick(20_000 * tick, (5, 6, 7))


def test_a_device_without_a_key_takes_both():
    for data in (image_bytes(IMAGE), seal(), seal(key=OTHER_KEY)):
        assert offered(data, ShimPlayer(50_000, WIDE)) == "MTM_OK"


def test_a_device_with_a_key_takes_sealed_ones_of_its_own_alone():
    assert offered(image_bytes(IMAGE)) == "MTM_IMAGE_UNSEALED"
    assert offered(seal(key=OTHER_KEY)) == "MTM_IMAGE_FORGED"
    assert offered(seal(channel=4)) == "MTM_IMAGE_OTHER_CHANNEL"
    assert offered(seal(counter=7), trusting(counter=7)) == "MTM_IMAGE_OLD"
    assert offered(seal(counter=7), trusting(counter=6)) == "MTM_OK"


def test_an_image_is_taken_once_and_no_older_one_after_it():
    player = trusting()
    assert player.offer(seal(counter=8)) == player.lib.MTM_OK
    assert player.shim.counter == 8
    player.tick(0, (0, 0, 0))
    for counter in (8, 7, 1):
        assert player.offer(seal(counter=counter)) == player.lib.MTM_IMAGE_OLD
    assert player.offer(seal(counter=9)) == player.lib.MTM_OK


def test_every_flipped_bit_of_a_seal_and_its_image_is_refused():
    data = bytearray(seal(image=message_image(ticks=40)))
    for bit in range(8 * len(data)):
        data[bit >> 3] ^= 1 << (bit & 7)
        assert trusting().offer(bytes(data)) != 0, bit
        with pytest.raises(MtmError, match="export it again"):
            parse_sealed(bytes(data), DEVICE_KEY)
        data[bit >> 3] ^= 1 << (bit & 7)


@given(st.binary(max_size=200), st.booleans())
def test_arbitrary_bytes_behind_a_seal_are_refused(data, trusts):
    player = trusting() if trusts else ShimPlayer(50_000, WIDE)
    assert player.offer(b"MTMS" + data) != 0


@pytest.mark.parametrize("size", [4, 5, 47, 48, 60, 139, 200])
def test_a_truncated_seal_is_refused(size):
    for player in (trusting(), ShimPlayer(50_000, WIDE)):
        assert player.offer(seal()[:size]) == player.lib.MTM_IMAGE_TRUNCATED


@pytest.mark.parametrize(("offset", "layout", "value", "says"), [
    (4, "<H", 2, "MTM_IMAGE_VERSION_UNKNOWN"), (6, "<H", 1, "MTM_IMAGE_TRUNCATED"),
    (8, "<I", 99, "MTM_IMAGE_TRUNCATED"),
    (20, "<I", (1 << 30) + 1, "MTM_IMAGE_INVALID"), (28, "<I", 1 << 30, "MTM_OK"),
])  # fmt: skip
def test_a_wrong_field_of_a_seal_is_refused(offset, layout, value, says):
    data = bytearray(seal())
    struct.pack_into(layout, data, offset, value)
    assert offered(bytes(data), ShimPlayer(50_000, WIDE)) == says


def test_noise_is_cut_at_the_seal_s_own_limit():
    bare, device = ShimPlayer(50_000, WIDE), trusting()
    bare.offer(IMAGE)
    device.offer(seal(limits=(0.05, 0.5, 0.0)))
    most = round(0.05 * ONE)
    noise = np.array([bare.tick(20_000 * tick, (0, 0, 0)) for tick in range(60)])
    cut = np.array([device.tick(20_000 * tick, (0, 0, 0)) for tick in range(60)])
    assert (np.abs(noise[:, 0]) > most).any()
    assert np.array_equal(cut[:, 0], np.clip(noise[:, 0], -most, most))
    assert np.array_equal(cut[:, 1], noise[:, 1])


def test_what_is_sealed_is_read_back():
    found, image = parse_sealed(seal(), DEVICE_KEY)
    assert (found.channel, found.counter, found.noise_limits_q20) == (3, 7, (ONE // 2,) * 3)
    assert image_bytes(image) == image_bytes(IMAGE)
    with pytest.raises(MtmError, match="not one of this device's key"):
        parse_sealed(seal(), OTHER_KEY)


@pytest.mark.parametrize(
    ("channel", "counter", "limits", "says"),
    [(-1, 1, (1, 1, 1), "device channel"), (1 << 32, 1, (1, 1, 1), "device channel"),
     (0, 0, (1, 1, 1), "count from 1"), (0, 1 << 32, (1, 1, 1), "counter"),
     (0, 1, (1, -1, 1), "noise limit -1"), (0, 1, (1, 1, 2000), "noise limit 2000")],
)  # fmt: skip
def test_a_seal_that_cannot_be_is_refused(channel, counter, limits, says):
    with pytest.raises(MtmError, match=says):
        seal_of(channel, counter, limits)
