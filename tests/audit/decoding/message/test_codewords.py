import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.decoding.message.codewords import likeliest_codewords
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.framing.code import encode_symbols
from mtm_onboard.protocol.framing.framing import layout_of
from tests.audit.decoding.message.simulated import simulated_ratios

SEEDS = st.integers(0, 2**32 - 1)


def all_codewords(framing, alphabet_size, count):
    """Every codeword's channel symbols, in order of its data."""
    layout = layout_of(framing, alphabet_size, count)
    return layout, np.array(encode_symbols(range(2**layout.data_bits), layout))


def spelled(data):
    return [int("".join(map(str, row)), 2) for row in data]


@pytest.mark.parametrize(
    ("framing", "alphabet_size", "count"),
    [(Framing("integer", 8), 4, 5), (Framing("integer", 9), 8, 3), (Framing("integer", 9), 2, 9)],
)
@given(seed=SEEDS)
def test_without_a_code_the_list_is_the_likeliest_messages(framing, alphabet_size, count, seed):
    layout, words = all_codewords(framing, alphabet_size, count)
    ratios = np.random.default_rng(seed).normal(size=(count, alphabet_size))
    carrying = layout.code_symbols * layout.group
    totals = ratios[np.arange(carrying), words[:, :carrying]].sum(axis=1)
    listed = likeliest_codewords(ratios, layout, 20)
    np.testing.assert_allclose(listed.log_likelihoods, np.sort(totals)[::-1][:20])
    np.testing.assert_allclose(listed.log_likelihoods, totals[spelled(listed.data)])


@given(seed=SEEDS, symbol_bits=st.sampled_from([1, 2, 3, 4]), data_bits=st.integers(1, 9), parity=st.integers(0, 6))
def test_what_is_listed_are_codewords_with_their_own_likelihoods(seed, symbol_bits, data_bits, parity):
    framing = Framing("integer", data_bits, code="reed-solomon")
    layout, words = all_codewords(framing, 2**symbol_bits, 24 // symbol_bits + 2 * parity)
    draw = np.random.default_rng(seed)
    ratios = simulated_ratios(words[draw.integers(len(words))], 2**symbol_bits, 1.0, draw, missing=0.2)
    listed = likeliest_codewords(ratios, layout, 2**data_bits)
    carrying = layout.code_symbols * layout.group
    totals = ratios[np.arange(carrying), words[:, :carrying]].sum(axis=1)
    # Asked for all of them, it gives all of them, once and in order.
    assert sorted(spelled(listed.data)) == list(range(2**data_bits))
    np.testing.assert_allclose(listed.log_likelihoods, totals[spelled(listed.data)], atol=1e-9)
    assert np.all(np.diff(listed.log_likelihoods) <= 1e-9)


def test_a_short_list_begins_with_the_likeliest_codeword():
    framing = Framing("integer", 12, code="reed-solomon")
    layout, words = all_codewords(framing, 4, 20)
    draw = np.random.default_rng(1)
    carrying = layout.code_symbols * layout.group
    right = 0
    for _ in range(100):
        ratios = simulated_ratios(words[draw.integers(len(words))], 4, 2.0, draw, missing=0.1)
        totals = ratios[np.arange(carrying), words[:, :carrying]].sum(axis=1)
        right += spelled(likeliest_codewords(ratios, layout, 256).data)[0] == np.argmax(totals)
    assert right >= 99


def test_any_symbols_that_fix_the_codeword_are_enough():
    framing = Framing("integer", 24, code="reed-solomon")
    layout = layout_of(framing, 16, 14)
    symbols = np.array(encode_symbols([0xABCDEF], layout)[0])
    for seen in itertools.islice(itertools.combinations(range(14), 6), 0, 3003, 100):
        ratios = np.zeros((14, 16))
        ratios[seen, symbols[list(seen)]] = 5.0
        assert spelled(likeliest_codewords(ratios, layout, 4).data)[0] == 0xABCDEF
