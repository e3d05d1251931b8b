"""Framed schemes and payloads that fit them, for the tests of framing."""

from hypothesis import strategies as st

from mtm_onboard.protocol import Channel, MtmError, Scheme
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.framing.framing import CRC_POLYNOMIALS, layout_of

FAKE_SECRET = b"not a real secret, only for test"
OTHER_SECRET = b"another fake one, only for tests"


def framed_scheme(framing, alphabet_size=4, counts=(12, 12, 12, 12), **changes):
    """Channels of `counts` symbols, each on a body of its own."""
    channels = tuple(Channel(f"c{n}", f"b{n}", ("vx",), count, 0.1) for n, count in enumerate(counts))
    ticks = 10_080
    return Scheme(
        name="t",
        rate_hz=50.0,
        band_hz=(2.0, 20.0),
        alphabet_size=alphabet_size,
        message_ticks=ticks,
        channels=channels,
        framing=framing,
        **changes,
    )


@st.composite
def framings(draw, checks=("none", "crc", "tag"), codes=("none", "reed-solomon")):
    """Any framing that can be built."""
    payload = draw(st.sampled_from(["integer", "bytes", "text"]))
    bits = draw(st.integers(1, 64)) if payload == "integer" else 8 * draw(st.integers(1, 12))
    check = draw(st.sampled_from(checks))
    widths = {"none": st.just(0), "crc": st.sampled_from(sorted(CRC_POLYNOMIALS)), "tag": st.integers(16, 64)}
    return Framing(
        payload,
        bits,
        number_bits=draw(st.integers(0, 16)),
        check=check,
        check_bits=draw(widths[check]),
        code=draw(st.sampled_from(codes)),
        interleave=draw(st.booleans()),
    )


def payloads(framing):
    """Payloads that this framing carries."""
    if framing.payload == "integer":
        return st.integers(0, 2**framing.payload_bits - 1)
    most = framing.payload_bits // 8
    if framing.payload == "bytes":
        return st.binary(min_size=1, max_size=most)
    texts = st.text(st.characters(categories=["L", "N", "P", "S"]), min_size=1, max_size=most)
    return texts.filter(lambda text: text.isprintable() and len(text.encode()) <= most)


@st.composite
def schemes(draw, **limits):
    """Any framed scheme with the frame's symbols and some more, all on one channel."""
    framing = draw(framings(**limits))
    bits = draw(st.sampled_from([1, 2, 3, 4, 8, 11]))
    count = -(-framing.data_bits // bits) + draw(st.integers(0, 30))
    try:
        layout_of(framing, 2**bits, count)
    except MtmError:
        count += 64
    return plain_row(framing, 2**bits, count)


def plain_row(framing, alphabet_size, count):
    """One channel of `count` symbols, in windows long enough for two tones."""
    return Scheme(
        name="t",
        rate_hz=50.0,
        band_hz=(2.0, 20.0),
        alphabet_size=alphabet_size,
        message_ticks=20 * count,
        channels=(Channel("c", "b", ("vx",), count, 0.1),),
        framing=framing,
    )
