from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol.framing import Framing, frame_order
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
