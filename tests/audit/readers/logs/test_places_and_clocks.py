"""Metres of latitudes, Unix times of boots, and dates without a zone."""

from datetime import datetime

import numpy as np
import pytest

from mtm_audit.readers.logs.boot_clock import booted_at, unix_of_gps
from mtm_audit.readers.logs.earth import north_east_m
from mtm_audit.readers.logs.wall_clock import captured_at


def test_a_minute_of_latitude_is_a_nautical_mile():
    north_m, east_m = north_east_m(np.array([45.0, 45.0 + 1 / 60]), np.array([7.0, 7.0]))
    assert north_m[1] == pytest.approx(1852.0, rel=1e-3)
    assert east_m.tolist() == [0.0, 0.0]


def test_meridians_meet_at_the_poles_and_not_at_the_date_line():
    _, east_m = north_east_m(np.array([60.0, 60.0]), np.array([179.9995, -179.9995]))
    # A degree is half as long at 60 degrees as at the equator, but for the earth's flattening.
    assert east_m[1] == pytest.approx(0.001 * 111_320 / 2, rel=5e-3)
    assert np.isnan(north_east_m(np.array([np.nan]), np.array([np.nan]))[0]).all()


def test_a_week_of_gps_is_a_date():
    # The second rollover of the 10-bit week, 2019-04-07 00:00:00 of GPS, eighteen leap seconds before that of UTC.
    assert (
        unix_of_gps(np.array([2048.0]), np.array([0.0]))[0]
        == datetime.fromisoformat("2019-04-06T23:59:42+00:00").timestamp()
    )


def test_one_late_record_and_those_without_a_fix_do_not_count():
    boot_s = np.arange(9.0)
    unix_s = 1.7e9 + boot_s
    unix_s[0], unix_s[1] = 0.0, unix_s[1] - 0.3
    assert booted_at(boot_s, unix_s).unix_s == 1.7e9
    assert booted_at([1.0], [np.nan]) is None


@pytest.mark.parametrize(
    ("text", "hour", "second"),
    [
        ("2026-01-31 01.02.03.500 PM", 13, 3.5),
        ("2026-01-31 12.02.03.5 am", 0, 3.5),
        ("2026-01-31, 13:02:03", 13, 3.0),
        ("2026-01-31T13:02:03.25", 13, 3.25),
        ("2026-01-31 01:02:03,5 p.m.", 13, 3.5),
    ],
)
def test_a_date_is_read_in_many_forms(text, hour, second):
    said = []
    at = captured_at(text, "take.csv", said.append)
    assert at.unix_s == datetime(2026, 1, 31, hour, 2).timestamp() + second
    assert len(said) == 1


def test_a_date_that_may_be_half_a_day_off_is_none():
    said = []
    assert captured_at("2023-11-28 10.27.58.765 DU.", "take.csv", said.append) is None
    assert ["not understood" in sentence for sentence in said] == [True]
    assert captured_at("", "take.csv", said.append) is None
    assert len(said) == 1
