from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol.framing import Framing, frame_order
from mtm_onboard.protocol.framing.framing import layout_of
from tests.onboard.protocol.framing.framed import framed_scheme

FRAMING = Framing("integer", 8, code="reed-solomon", interleave=True)


def interleaved(counts=(12, 12, 12, 12), combine="split", schedule="rolling", framing=FRAMING):
    return framed_scheme(framing, counts=counts, combine=combine, schedule=schedule)


@given(st.lists(st.sampled_from([8, 9, 10, 12]), min_size=1, max_size=5), st.integers(0, 2**40), st.booleans())
def test_every_symbol_is_played_once(counts, slot, coded):
    scheme = interleaved(counts, framing=FRAMING if coded else replace(FRAMING, code="none"))
    order = frame_order(scheme, slot)
    assert sorted(order) == list(range(scheme.message_symbols))


def test_without_interleaving_the_order_is_the_frame_s():
    for framing in (None, replace(FRAMING, interleave=False)):
        np.testing.assert_array_equal(frame_order(interleaved(framing=framing), 5), np.arange(48))


def test_the_order_changes_with_the_slot_when_the_schedule_rolls():
    rolling, fixed = interleaved(), interleaved(schedule="fixed")
    assert not np.array_equal(frame_order(rolling, 0), frame_order(rolling, 1))
    np.testing.assert_array_equal(frame_order(fixed, 0), frame_order(fixed, 1))
    np.testing.assert_array_equal(frame_order(fixed, 3), frame_order(rolling, 0))


def test_a_code_symbol_stays_on_one_channel():
    order = frame_order(interleaved(), 3).reshape(4, 12)
    homes = {symbol: channel for channel, row in enumerate(order) for symbol in row}
    assert all(homes[3 * word] == homes[3 * word + 1] == homes[3 * word + 2] for word in range(16))


@pytest.mark.parametrize("hidden", [range(12), range(36, 48), [*range(6), *range(12, 18), *range(24, 30)]])
def test_what_one_repetition_hides_the_next_ones_show(hidden):
    scheme = interleaved()
    seen = np.zeros(48, dtype=int)
    for slot in range(1000, 1016):
        seen[frame_order(scheme, slot)] += [position not in hidden for position in range(48)]
    share = 1.0 - len(hidden) / 48
    assert seen.min() >= 16 * share - 1
    assert seen.max() <= 16 * share + 1


def test_channels_that_say_the_same_share_one_order():
    order = frame_order(interleaved(counts=(12, 12), combine="same"), 0)
    np.testing.assert_array_equal(order, np.arange(12))


# By hand from docs/framing.md: GF(16) over symbols of two bits, so that runs are pairs.
PAIRS = Framing("integer", 4, code="reed-solomon", interleave=True)


@pytest.mark.parametrize(
    ("counts", "slot", "order"),
    [
        # n = 6: round(0.618 n) = 4 has a divisor in common with 6, so that the step is 5 code symbols.
        ((6, 6), 0, [0, 1, 4, 5, 8, 9, 2, 3, 6, 7, 10, 11]),
        ((6, 6), 1, [10, 11, 2, 3, 6, 7, 0, 1, 4, 5, 8, 9]),
        ((6, 6), 7, [10, 11, 2, 3, 6, 7, 0, 1, 4, 5, 8, 9]),
        ((6, 6), 2, [8, 9, 0, 1, 4, 5, 10, 11, 2, 3, 6, 7]),
        # Windows of three lengths; the run that is too short for a pair is filler.
        ((8, 4, 1), 0, [0, 1, 4, 5, 6, 7, 10, 11, 2, 3, 8, 9, 12]),
        ((8, 4, 1), 1, [10, 11, 2, 3, 4, 5, 8, 9, 0, 1, 6, 7, 12]),
        # n = 3: the step is 2.
        ((6,), 0, [0, 1, 2, 3, 4, 5]),
        ((6,), 1, [4, 5, 0, 1, 2, 3]),
    ],
)
def test_the_order_is_the_documented_one(counts, slot, order):
    assert frame_order(interleaved(counts, framing=PAIRS), slot).tolist() == order


# Codewords of 8, 10, 12, 13, 14, 16 and 20 code symbols: the next number from 0.618 n on that shares no divisor with n.
@pytest.mark.parametrize(("symbols", "step"), [(16, 5), (20, 7), (24, 7), (40, 8), (28, 9), (48, 11), (60, 13)])
def test_from_slot_to_slot_the_codeword_turns_by_0_618(symbols, step):
    group = layout_of(PAIRS, 4, symbols).group
    first, second = (int(frame_order(interleaved((symbols,), framing=PAIRS), slot)[0]) for slot in (0, 1))
    assert (first, second) == (0, step * group)
