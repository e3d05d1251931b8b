"""A day's key in the motion of a later day's robots."""

import pytest

from hil.experiments.messages.disclosures import SIGHTS, key_bps, recover, seconds_of


def test_a_whole_message_carries_more_than_two_bits_a_second():
    whole = SIGHTS["four robots, one message"]
    assert seconds_of(whole) == 96.0
    assert key_bps(whole) == pytest.approx(256 / 96)
    assert min(map(key_bps, SIGHTS.values())) > 2.0


@pytest.mark.long
@pytest.mark.parametrize("sight", SIGHTS)
def test_the_key_is_recovered_from_motion(sight):
    assert recover({"sight": sight}, 5) == {"decoded": True, "recovered": True, "wrong": False}
