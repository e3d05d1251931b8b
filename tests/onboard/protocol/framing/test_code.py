import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.framing.code import decode_symbols, encode_symbols
from mtm_onboard.protocol.framing.framing import layout_of

# Ten bits in symbols of four: two bits of padding, two symbols of filler.
PLAIN = layout_of(Framing("integer", 10), 16, 5)
# Ten bits in GF(16): three data symbols, two of parity.
SHORT = layout_of(Framing("integer", 10, code="reed-solomon"), 16, 5)
# Twenty bits in GF(64) over symbols of two bits: four data symbols, six of parity, two channel symbols of filler.
GROUPED = layout_of(Framing("integer", 20, code="reed-solomon"), 4, 32)


def test_the_layouts_are_those_that_these_tests_are_about():
    assert (PLAIN.data_symbols, PLAIN.parity, PLAIN.group, PLAIN.filler) == (3, 0, 1, 2)
    assert (SHORT.field_bits, SHORT.data_symbols, SHORT.parity, SHORT.filler) == (4, 3, 2, 0)
    assert (GROUPED.field_bits, GROUPED.group, GROUPED.data_symbols, GROUPED.parity) == (6, 3, 4, 6)
    assert GROUPED.filler == 2


def test_without_a_code_symbols_are_the_data_padding_and_filler():
    assert encode_symbols([0b1101_0110_01, 0], PLAIN) == [(0b1101, 0b0110, 0b0100, 0, 0), (0, 0, 0, 0, 0)]
    assert decode_symbols((0b1101, 0b0110, 0b0100, 0, 0), PLAIN) == 0b1101_0110_01


# In GF(16) with x^4 + x + 1 the generator of two roots is x^2 + 3 x + 2, and 4 x^2 leaves 12 x + 8.
def test_parity_follows_the_data_highest_power_first():
    assert encode_symbols([1], SHORT) == [(0, 0, 4, 12, 8)]


def test_a_code_symbol_is_dealt_highest_bits_first():
    (symbols,) = encode_symbols([0b00_0000_000000_011011], layout_of(Framing("integer", 18), 64, 3))
    assert symbols == (0, 0, 0b011011)
    (grouped,) = encode_symbols([0b011011_000000_000000_00], GROUPED)
    assert grouped[:12] == (0b01, 0b10, 0b11, *[0] * 9)
    assert grouped[30:] == (0, 0)


@given(st.integers(0, 2**20 - 1), st.permutations(range(10)), st.integers(0, 3))
def test_errors_and_losses_are_corrected_up_to_the_parity(data, places, errors):
    (symbols,) = encode_symbols([data], GROUPED)
    spoilt = list(symbols)
    for place in places[:errors]:
        spoilt[3 * place + 1] ^= 0b10
    for place in places[errors : 6 - errors]:
        spoilt[3 * place + 2] = None
    assert decode_symbols(spoilt, GROUPED) == data


@given(st.integers(0, 2**20 - 1), st.permutations(range(10)))
def test_more_losses_than_parity_are_refused(data, places):
    spoilt = list(encode_symbols([data], GROUPED)[0])
    for place in places[:7]:
        spoilt[3 * place] = None
    with pytest.raises(MtmError, match="than 6 code symbols of parity can correct; record for longer"):
        decode_symbols(spoilt, GROUPED)


def test_without_a_code_no_symbol_may_be_missing():
    with pytest.raises(MtmError, match="2 symbols were not seen and the frame has no code"):
        decode_symbols((None, 1, None, 0, 0), PLAIN)
    # Nothing is written in the filler, so that nothing is missed there.
    assert decode_symbols((0, 0, 4, None, None), PLAIN) == 1


@pytest.mark.parametrize("last", [0b0001, 0b0010])
def test_bits_of_padding_that_are_not_zero_are_refused(last):
    with pytest.raises(MtmError, match="always zero"):
        decode_symbols((0, 0, last, 0, 0), PLAIN)
