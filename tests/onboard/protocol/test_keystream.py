import hashlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol.keystream import SECRET_BYTES, stream, streams

FAKE_SECRET = b"not a real secret, only for test"
words = st.integers(0, 2**64 - 1)


def test_a_stream_is_shake_256_of_secret_label_and_integers():
    taken = b"\x03tag" + b"\x01\0\0\0\0\0\0\0" + b"\0\0\0\0\0\0\0\x80"
    assert stream(FAKE_SECRET, "tag", (1, 1 << 63), 40) == hashlib.shake_256(FAKE_SECRET + taken).digest(40)
    assert stream(FAKE_SECRET, "tag", (), 8) == hashlib.shake_256(FAKE_SECRET + b"\x03tag").digest(8)


# Computed with `openssl dgst -shake256 -xoflen 16` from the bytes named in the docstring of `stream`.
def test_the_first_bytes_of_a_stream_are_these():
    assert stream(FAKE_SECRET, "symbol", (0, 0, 3, 1), 16).hex() == "cb5eaedf518d0078c1abec306a762a10"


@given(st.integers(0, 300))
def test_a_longer_stream_begins_with_the_shorter_one(size):
    assert stream(FAKE_SECRET, "symbol", (7,), 300)[:size] == stream(FAKE_SECRET, "symbol", (7,), size)


@given(st.lists(st.lists(words, max_size=4).map(tuple), max_size=4), st.integers(0, 40))
def test_many_streams_are_each_stream_in_turn(places, size):
    alone = [stream(FAKE_SECRET, "symbol", place, size) for place in places]
    assert streams(FAKE_SECRET, "symbol", places, size) == b"".join(alone)


@given(st.lists(words, max_size=5), st.lists(words, max_size=5))
def test_streams_of_other_integers_are_others(some, others):
    one, other = (stream(FAKE_SECRET, "symbol", tuple(place), 16) for place in (some, others))
    assert (one == other) == (some == others)


def test_labels_have_1_to_255_ascii_characters():
    assert len(stream(FAKE_SECRET, "a", (), 4)) == len(stream(FAKE_SECRET, "a" * 255, (), 4)) == 4
    for label in ("", "a" * 256):
        with pytest.raises(ValueError, match="1 to 255 characters"):
            stream(FAKE_SECRET, label, (), 4)
    with pytest.raises(ValueError, match="ascii"):
        stream(FAKE_SECRET, "é", (), 4)


@pytest.mark.parametrize("value", [-1, 1 << 64])
def test_integers_outside_64_bits_are_refused(value):
    with pytest.raises(ValueError, match="unsigned 64-bit"):
        stream(FAKE_SECRET, "symbol", (0, value), 4)


@pytest.mark.parametrize("size", [0, SECRET_BYTES - 1, SECRET_BYTES + 1])
def test_a_secret_has_32_bytes(size):
    assert SECRET_BYTES == 32
    with pytest.raises(ValueError, match="32 bytes"):
        stream(bytes(size), "symbol", (), 4)
