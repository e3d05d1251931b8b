import math
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.slots import EPOCH_S, epoch_of_slot, next_slot, slot_at, slot_start_unix_s
from tests.onboard.schemes import small_scheme

# T = 120 and 150 divide a day at 50 Hz, 1,110 and 4,950 do not; the odd rates have no exact floating-point number.
SCHEMES = [small_scheme(message_ticks=ticks) for ticks in (120, 150, 1_110, 4_950)]
SCHEMES += [small_scheme(rate_hz=rate_hz) for rate_hz in (49.95, 66.6)]
A_DAY_LONG = small_scheme(rate_hz=5.0, message_ticks=5 * 86_424, band_hz=(1.0, 1.001))
schemes = st.sampled_from(SCHEMES)
times_s = st.floats(0.0, 4e9)
slots = st.integers(0, 10**9)


def test_slots_are_a_message_long_from_the_unix_epoch_on():
    scheme = small_scheme(message_ticks=120)
    assert [slot_at(unix_s, scheme) for unix_s in (0.0, 2.39, 2.4, 24.0)] == [0, 0, 1, 10]
    assert slot_start_unix_s(10, scheme) == 24.0
    assert slot_at(-0.1, scheme) == -1


@given(schemes, times_s)
def test_every_instant_is_in_the_slot_that_started_last(scheme, unix_s):
    slot = slot_at(unix_s, scheme)
    assert slot_start_unix_s(slot, scheme) <= unix_s < slot_start_unix_s(slot + 1, scheme)


@given(schemes, slots)
def test_a_slot_is_under_way_at_its_own_start(scheme, slot):
    assert slot_at(slot_start_unix_s(slot, scheme), scheme) == slot


@given(schemes, times_s)
def test_the_next_slot_is_early_by_a_microsecond_at_most(scheme, unix_s):
    slot = next_slot(unix_s, scheme)
    assert slot_start_unix_s(slot - 1, scheme) < unix_s <= slot_start_unix_s(slot, scheme) + 1.1e-6


@given(schemes, slots)
def test_the_next_slot_at_a_decimal_start_is_that_slot(scheme, slot):
    assert next_slot(float(f"{slot_start_unix_s(slot, scheme):.6f}"), scheme) == slot


@given(schemes, slots)
def test_a_slot_belongs_to_the_utc_day_it_starts_in(scheme, slot):
    epoch, _ = epoch_of_slot(slot, scheme)
    start = datetime.fromtimestamp(slot_start_unix_s(slot, scheme), UTC)
    assert epoch == (start - datetime(1970, 1, 1, tzinfo=UTC)).days


@given(schemes, slots)
def test_slots_count_from_zero_in_each_epoch_and_without_a_gap(scheme, slot):
    (epoch, number), (next_epoch, next_number) = (epoch_of_slot(one, scheme) for one in (slot, slot + 1))
    assert (next_epoch, next_number) in {(epoch, number + 1), (epoch + 1, 0)}


@given(schemes, st.integers(1, 40_000))
def test_the_slot_across_midnight_is_of_the_day_before(scheme, day):
    midnight_s = float(day * EPOCH_S)
    first = next_slot(midnight_s, scheme)
    assert epoch_of_slot(first, scheme) == (day, 0)
    assert epoch_of_slot(first - 1, scheme)[0] == day - 1
    starts_at_midnight = slot_start_unix_s(first, scheme) == midnight_s
    assert slot_at(midnight_s, scheme) == (first if starts_at_midnight else first - 1)


def test_a_message_longer_than_a_day_leaves_no_two_slots_alike():
    assert A_DAY_LONG.message_ticks / A_DAY_LONG.rate_hz > EPOCH_S
    places = [epoch_of_slot(slot, A_DAY_LONG) for slot in range(10_000)]
    assert len(set(places)) == len(places)


def test_epochs_count_from_the_scheme_s_own():
    assert epoch_of_slot(0, small_scheme(epoch=7)) == (7, 0)
    assert epoch_of_slot(36_001, small_scheme(epoch=7)) == (8, 1)


@pytest.mark.parametrize("unix_s", [math.nan, math.inf, -math.inf])
def test_what_is_no_time_is_refused(unix_s):
    with pytest.raises(MtmError, match="not a number of seconds"):
        slot_at(unix_s, SCHEMES[0])


def test_a_slot_before_1970_has_no_epoch():
    with pytest.raises(MtmError, match="set the clock"):
        epoch_of_slot(-1, SCHEMES[0])


def test_a_microsecond_after_its_start_a_slot_is_still_the_next():
    scheme = small_scheme(message_ticks=120)
    assert [next_slot(unix_s, scheme) for unix_s in (0.0, 1e-6, 2e-6)] == [0, 0, 1]
