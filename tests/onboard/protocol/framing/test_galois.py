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


def test_a_generator_may_lack_powers():
    # In GF(4) the roots 1, 2 and 3 are all there are: their generator is x^3 + 1, so that parity is the last symbol.
    assert parity_of([2], 3, 2) == [0, 0, 2]
    assert parity_of([2, 1], 3, 2) == [0, 2, 1]
