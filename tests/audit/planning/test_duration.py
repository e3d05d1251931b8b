from dataclasses import replace

import pytest

from mtm_audit.planning.duration import required_duration
from mtm_audit.planning.table import AccuracyPoint, AccuracyTable
from mtm_onboard.protocol import Channel, MtmError, Scheme


def scheme(*counts, ticks=300, combine="split"):
    channels = tuple(Channel(name, name, ("vx",), count, 0.1) for name, count in zip("xyz", counts, strict=False))
    return Scheme(
        name="test",
        rate_hz=50.0,
        band_hz=(0.5, 5.0),
        alphabet_size=4,
        message_ticks=ticks,
        channels=channels,
        combine=combine,
    )


def table(*rights, name="x", step=100):
    points = [AccuracyPoint(name, 4, step * place, right, 100) for place, right in enumerate(rights, 1)]
    return AccuracyTable(tuple(points))


def test_one_message_suffices_of_accurate_windows():
    found = required_duration(scheme(1), table(50, 80, 95), 2, 0.9)
    assert (found.repeats, found.from_start_s, found.accuracy) == (1, 6.0, 0.95)
    # Begun in the middle of a message, a recording of one more window still has each window whole.
    assert found.anywhere_s == 12.0
    assert found.interval[0] < 0.95 < found.interval[1]


def test_repeats_count_as_one_longer_window():
    found = required_duration(scheme(3), table(50, 80, 95, 99), 6, 0.9)
    # Windows of 100 ticks: four of them have 0.99 each, and three only 0.95.
    assert found.repeats == 4
    assert found.from_start_s == 24.0
    assert found.anywhere_s == 26.0
    assert found.accuracy == pytest.approx(0.99**3)


def test_repeats_of_few_tones_are_said_to_gain_less():
    short, rights = table(30, 60, 95, step=30), 0.9
    fixed = required_duration(scheme(1, ticks=30), short, 2, rights)
    assert (fixed.repeats, fixed.tones, fixed.repeats_gain_less) == (3, 3, True)
    rolling = replace(scheme(1, ticks=30), schedule="rolling")
    assert not required_duration(rolling, short, 2, rights).repeats_gain_less
    assert not required_duration(scheme(1, ticks=90), short, 2, rights).repeats_gain_less
    assert not required_duration(scheme(1), table(50, 80, 95, 95, 95, 99), 2, 0.96).repeats_gain_less


def test_every_channel_of_a_split_message_counts():
    both = AccuracyTable((*table(90, 95, 99).points, *table(70, 80, 90, name="y").points))
    found = required_duration(scheme(1, 1, ticks=100), both, 4, 0.85)
    assert (found.repeats, found.accuracy) == (3, pytest.approx(0.99 * 0.90))


def test_channels_that_carry_the_same_need_their_pooled_row():
    pooled = table(80, 95, name="y+x")
    found = required_duration(scheme(1, 1, ticks=100, combine="same"), pooled, 2, 0.9)
    assert (found.repeats, found.accuracy) == (2, 0.95)
    with pytest.raises(MtmError, match=r"no x\+y at M = 4, which this key uses; measure it \(the table has x at M = 4"):
        required_duration(scheme(1, 1, ticks=100, combine="same"), table(80, 95), 2, 0.9)


@pytest.mark.parametrize(
    ("bits", "target", "says"),
    [
        (3, 0.9, "a payload of 3 bits does not fit: a message of this key carries 1 to 2 bits"),
        (0, 0.9, "does not fit"),
        (2, 1.0, "choose one above 0 and below 1"),
        (2, 0.99, "the table give an accuracy of 0.95, not 0.99; lower the target, or measure longer windows"),
    ],
)
def test_what_cannot_be_is_refused_with_what_can(bits, target, says):
    with pytest.raises(MtmError, match=says):
        required_duration(scheme(1, ticks=100), table(50, 80, 95), bits, target)


def test_windows_longer_than_measured_count_as_the_longest():
    found = required_duration(scheme(1, ticks=400), table(50, 80, 95), 2, 0.5)
    assert (found.repeats, found.accuracy, found.beyond) == (1, 0.95, True)
    assert not required_duration(scheme(1, ticks=300), table(50, 80, 95), 2, 0.5).beyond


def test_windows_shorter_than_any_measured_are_not_guessed():
    # One window of 50 ticks lies below the table, two of them do not.
    assert required_duration(scheme(1, ticks=50), table(50, 80, 95), 2, 0.4).repeats == 2
