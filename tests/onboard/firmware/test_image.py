"""The image: what is written is read back, and what is altered is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.firmware.image import channel_image, image_bytes, parse_image, tag_is_good, tagged
from mtm_onboard.protocol import Channel, Codebook, MtmError, Scheme

SECRET = b"not a real secret, only for test"
LIMITS = (3.5, 3.5, 10.0)


def codebook(schedule="fixed", *, axes=("vx", "vy"), sigma=0.1, rate_hz=50.0, ticks=60):
    channel = Channel("robot", "robot", axes, 2, sigma)
    band_hz = (rate_hz / 50, rate_hz / 10)
    return Codebook(
        SECRET,
        Scheme(
            name="test",
            rate_hz=rate_hz,
            band_hz=band_hz,
            alphabet_size=4,
            message_ticks=ticks,
            channels=(channel,),
            schedule=schedule,
        ),
    )


def an_image(schedule="fixed", **options):
    return channel_image(codebook(schedule), "robot", (1, 2), limits=LIMITS, **options)


@pytest.mark.parametrize(
    "image", [an_image(), an_image("rolling", first_message=7, messages=3)], ids=["fixed", "rolling"]
)
def test_what_is_written_is_read_back(image):
    read = parse_image(image_bytes(tagged(image, SECRET)))
    np.testing.assert_array_equal(read.samples, image.samples)
    written = {name: value for name, value in vars(image).items() if name not in ("samples", "tag")}
    assert {name: value for name, value in vars(read).items() if name not in ("samples", "tag")} == written


def test_the_layout_is_the_documented_one():
    data = image_bytes(an_image())
    assert data[:8] == b"MTMI\x01\x00\x03\x01"
    assert len(data) == 88 + 2 * 2 * 60 + 4
    assert int.from_bytes(data[8:12], "little") == len(data)
    assert int.from_bytes(data[12:16], "little") == 50_000


@given(where=st.integers(0, 10_000), bit=st.integers(0, 7))
def test_a_flipped_bit_is_refused(where, bit):
    data = bytearray(image_bytes(an_image()))
    data[where % len(data)] ^= 1 << bit
    with pytest.raises(MtmError, match="export it again"):
        parse_image(bytes(data))


@given(st.integers(0, 331))
def test_a_beginning_alone_is_refused(size):
    with pytest.raises(MtmError, match="export it again"):
        parse_image(image_bytes(an_image())[:size])


def test_the_tag_holds_for_its_secret_and_its_content_alone():
    image = parse_image(image_bytes(tagged(an_image(), SECRET)))
    assert tag_is_good(image, SECRET)
    assert not tag_is_good(image, bytes(32))
    assert not tag_is_good(replace(image, rate_mhz=50_001), SECRET)
    changed = image.samples.copy()
    changed[1, 30] += 1
    assert not tag_is_good(replace(image, samples=changed), SECRET)


def noise_of(image, row, axis):
    """The row of samples in m/s, and its resolution."""
    unit = image.steps[axis] / 2**36
    return image.samples[row].astype(float) * unit, unit


def test_samples_use_the_whole_range_in_the_order_of_axes():
    book = codebook()
    noise = 0.1 * np.concatenate([book.samples(book.scheme.channels[0], 0, [s])[0] for s in (1, 2)], axis=1)
    straight = an_image()
    played, unit = noise_of(straight, 0, 0)
    np.testing.assert_allclose(played, noise[0], atol=unit / 2 * 1.001)
    assert np.abs(straight.samples).max(axis=1).tolist() == [32_767, 32_767]
    # The channel's first axis is wz, and that is the second row of the image.
    swapped = channel_image(codebook(axes=("wz", "vx")), "robot", (1, 2), limits=LIMITS)
    played, unit = noise_of(swapped, 1, 2)
    np.testing.assert_allclose(played, noise[0], atol=unit / 2 * 1.001)
    assert swapped.steps[1] == 0


def test_rolling_messages_are_those_of_their_numbers():
    several, several_unit = noise_of(an_image("rolling", first_message=4, messages=3), 0, 0)
    alone, alone_unit = noise_of(an_image("rolling", first_message=5), 0, 0)
    np.testing.assert_allclose(several[60:120], alone, atol=(several_unit + alone_unit) / 2 * 1.001)
    assert not an_image("rolling").repeats


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"symbols": (1,)}, "sends 2 symbols"),
        ({"symbols": (1, 9)}, "outside the alphabet"),
        ({"messages": 2}, "fixed schedule"),
        ({"first_message": -1, "book": codebook("rolling")}, "counted from 0"),
        ({"messages": 0, "book": codebook("rolling")}, "1 to 4096"),
        ({"messages": 4097, "book": codebook("rolling")}, "1 to 4096"),
        ({"book": codebook(axes=("elbow",))}, "'elbow'"),
        ({"book": codebook(sigma=400.0)}, "lower sigma"),
        ({"book": codebook(rate_hz=50.00001)}, "rate_hz"),
        ({"book": codebook(rate_hz=2000.0)}, "rate_hz"),
        ({"limits": (3.5, 0.0, 1.0)}, "limit 0"),
        ({"limits": (3.5, 3.5, float("nan"))}, "limit nan"),
        ({"limits": (1025.0, 3.5, 1.0)}, "limit 1025"),
        ({"book": codebook(ticks=(1 << 20) + 2)}, "too long"),
    ],
)
def test_what_cannot_be_played_is_refused_with_a_remedy(options, words):
    given_options = {"symbols": (1, 2), "limits": LIMITS, "book": codebook()} | options
    book, symbols = given_options.pop("book"), given_options.pop("symbols")
    with pytest.raises(MtmError, match=words):
        channel_image(book, "robot", symbols, **given_options)
