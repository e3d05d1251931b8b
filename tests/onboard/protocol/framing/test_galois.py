import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol.framing.galois import PRIMITIVE_POLYNOMIALS, parity_of

reedsolo = pytest.importorskip("reedsolo")


@given(st.data())
def test_the_parity_is_that_of_an_independent_library(data):
    field_bits = data.draw(st.sampled_from(sorted(PRIMITIVE_POLYNOMIALS)))
    most = min((1 << field_bits) - 1, 60)
    parity = data.draw(st.integers(1, most - 1))
    symbols = st.integers(0, (1 << field_bits) - 1)
    words = data.draw(st.lists(symbols, min_size=1, max_size=most - parity))
    codec = reedsolo.RSCodec(parity, nsize=most, prim=PRIMITIVE_POLYNOMIALS[field_bits], c_exp=field_bits)
    assert [*words, *parity_of(words, parity, field_bits)] == list(codec.encode(words))


def test_nothing_but_zeros_has_zeros_for_parity():
    assert parity_of([0] * 10, 4, 8) == [0] * 4


@pytest.mark.parametrize("field_bits", [2, 3, 4])
def test_no_generator_lacks_a_power(field_bits):
    # Of one data symbol, 1, the parity is the generator itself.
    for parity in range(1, (1 << field_bits) - 1):
        assert all(parity_of([1], parity, field_bits))


# As docs/framing.md has them: a change would make a frame that is sent another one for everybody who reads it.
DOCUMENTED = [0x7, 0xB, 0x13, 0x25, 0x43, 0x89, 0x11D, 0x211, 0x409, 0x805, 0x1053, 0x201B, 0x4443, 0x8003, 0x1100B]


def test_there_is_a_field_for_each_width_from_2_to_16():
    assert dict(zip(range(2, 17), DOCUMENTED, strict=True)) == PRIMITIVE_POLYNOMIALS


@pytest.mark.parametrize("field_bits", range(2, 17))
def test_the_element_2_runs_through_the_whole_field(field_bits):
    value, order = 2, 1
    while value != 1:
        value <<= 1
        if value >> field_bits:
            value ^= PRIMITIVE_POLYNOMIALS[field_bits]
        order += 1
    assert order == (1 << field_bits) - 1
