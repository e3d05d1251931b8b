from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import Key, MtmError, load_key, save_key
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.framing.framing import Layout, layout_of
from mtm_onboard.protocol.framing.galois import PRIMITIVE_POLYNOMIALS
from mtm_onboard.protocol.key import key_text
from tests.onboard.protocol.framing.framed import FAKE_SECRET, framed_scheme, framings

FRAMING = Framing("integer", 16, number_bits=8, check="tag", check_bits=24, code="reed-solomon", interleave=True)


def test_the_field_is_as_small_as_holds_the_codeword():
    # 48 bits of data: 48 symbols of 2 bits are 24 symbols of GF(16), too many, and 16 of GF(64).
    assert layout_of(FRAMING, 4, 48) == Layout(48, 2, 6, 8, 16, 0)
    assert layout_of(FRAMING, 4, 50) == Layout(48, 2, 6, 8, 16, 2)
    assert layout_of(FRAMING, 256, 20) == Layout(48, 8, 8, 6, 20, 0)
    assert layout_of(replace(FRAMING, code="none"), 4, 50) == Layout(48, 2, 2, 24, 24, 26)


@given(framings(), st.integers(1, 16), st.integers(1, 700))
def test_a_frame_that_does_not_fit_says_what_would(framing, symbol_bits, count):
    try:
        layout = layout_of(framing, 2**symbol_bits, count)
    except MtmError as error:
        if "at most" in str(error):
            most = int(str(error).split(" has ")[1].split()[0])
            assert count > most
            return
        needed = int(str(error).split(";")[1].split()[0])
        assert needed > count
        layout, count = layout_of(framing, 2**symbol_bits, needed), needed
    assert layout.data_bits <= layout.data_symbols * layout.field_bits
    assert layout.code_symbols * layout.group + layout.filler == count
    assert layout.parity >= 2 or framing.code == "none"
    assert layout.code_symbols < 2**layout.field_bits or framing.code == "none"


def test_a_scheme_that_cannot_hold_its_frame_is_refused():
    with pytest.raises(MtmError, match="48 bits and 2 code symbols of parity do not fit into the 4 symbols"):
        framed_scheme(FRAMING, counts=(1, 1, 1, 1))
    with pytest.raises(MtmError, match="power of two, and 6 is none; choose 4 or 8"):
        framed_scheme(FRAMING, alphabet_size=6)


@pytest.mark.parametrize("field_bits", sorted(PRIMITIVE_POLYNOMIALS))
def test_the_field_polynomials_are_primitive(field_bits):
    element, order = 2, 1
    while element != 1:
        element <<= 1
        element ^= PRIMITIVE_POLYNOMIALS[field_bits] if element >> field_bits else 0
        order += 1
    assert order == 2**field_bits - 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"payload": "float"}, "choose one of: integer, bytes, text"),
        ({"payload_bits": 65}, "1 to 64 bits"),
        ({"payload_bits": 0}, "1 to 64 bits"),
        ({"payload": "bytes", "payload_bits": 12}, "give 8 for each byte"),
        ({"payload": "text", "payload_bits": 65 * 8}, "8 to 512"),
        ({"number_bits": 17}, "choose 0 to 16"),
        ({"number_bits": -1}, "give a whole number"),
        ({"number_bits": True}, "give a whole number"),
        ({"check": "none"}, 'check_bits is 24 but check is "none"'),
        ({"check_bits": 8}, "choose 16 to 64"),
        ({"check": "crc", "check_bits": 20}, "no CRC of 20 bits; choose one of: 16, 24, 32, 40, 64"),
        ({"check": "hash"}, "choose one of: none, crc, tag"),
        ({"code": "turbo"}, "choose one of: none, reed-solomon"),
        ({"interleave": 1}, "choose true or false"),
    ],
)
def test_a_framing_that_cannot_be_built_is_refused(changes, words):
    with pytest.raises(MtmError, match=words):
        replace(FRAMING, **changes)


def test_more_symbols_than_the_largest_field_has_are_refused():
    with pytest.raises(MtmError, match="over an alphabet of 2048 has 2047 symbols at most"):
        layout_of(FRAMING, 2048, 2048)


@given(framings())
def test_a_key_file_keeps_its_framing(tmp_path_factory, framing):
    key = Key("fleet-7", FAKE_SECRET, framed_scheme(framing, alphabet_size=256, counts=(30, 30)))
    path = tmp_path_factory.mktemp("keys") / "k.key"
    save_key(key, path)
    assert load_key(path) == key


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[scheme.framing]", "[[scheme.framing]]", "must be a table"),
        ("payload_bits = 16\n", "", "the scheme's framing lacks payload_bits"),
        ("check_bits", "chek_bits", "unknown field 'chek_bits'"),
        ('payload = "integer"', "payload = []", "choose one of: integer"),
    ],
)
def test_a_key_file_with_a_spoilt_framing_is_refused(tmp_path, old, new, words):
    path = tmp_path / "k.key"
    text = key_text(Key("k", FAKE_SECRET, framed_scheme(FRAMING)))
    assert old in text
    path.write_text(text.replace(old, new))
    path.chmod(0o600)
    with pytest.raises(MtmError, match=words):
        load_key(path)


def test_only_a_framing_changes_the_fingerprint():
    plain, framed = framed_scheme(None), framed_scheme(FRAMING)
    assert plain.fingerprint == "46aecdf11484c066"
    assert len({plain.fingerprint, framed.fingerprint, framed_scheme(replace(FRAMING, check_bits=16)).fingerprint}) == 3
