"""The chain of days: who has the anchor and a day's disclosed key accepts that day and no other."""

from dataclasses import replace
from datetime import UTC, date, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import Key, MtmError, load_key
from mtm_onboard.protocol.disclosure import (
    anchor_of,
    disclosed_key,
    load_anchor,
    load_disclosed,
    reaches,
    save_anchor,
    save_disclosed,
)
from mtm_onboard.protocol.holding import epoch_of_day
from mtm_onboard.protocol.key import generate_key, generate_master
from mtm_onboard.protocol.key_tree import tree_of
from tests.onboard.schemes import FAKE_SECRET, small_scheme

SCHEME = small_scheme(schedule="rolling")
FIRST = date(2026, 1, 1)
MASTER = generate_master("fake-fleet", SCHEME, FIRST, 365)
ANCHOR = anchor_of(MASTER)
LATER = datetime(2027, 6, 1, tzinfo=UTC)
days = st.integers(0, 364).map(lambda number: FIRST + timedelta(number))


def disclosed(day: date) -> Key:
    return disclosed_key(MASTER, day, LATER)


@given(days)
def test_the_key_of_a_day_is_accepted_for_its_day(day):
    key = ANCHOR.verified(disclosed(day))
    grant = key.holding.grant
    assert (grant.first_day, grant.last_day) == (day, day)
    epoch = grant.epochs(SCHEME)[0]
    for channel in (0, 1):
        assert key.holding.channel_secret(epoch, channel) == MASTER.holding.channel_secret(epoch, channel)
        with pytest.raises(MtmError, match="is for"):
            key.holding.channel_secret(epoch + 1, channel)


@given(days, days)
def test_the_key_of_a_day_is_accepted_for_no_other(day, other):
    link = disclosed(day).holding.link
    assert ANCHOR.holds(link, other) is (day == other)
    if day != other:
        held = disclosed(day).holding
        dated = replace(held, grant=replace(held.grant, first_day=other, last_day=other))
        with pytest.raises(MtmError, match="is not the one of"):
            ANCHOR.verified(replace(disclosed(day), secret=dated))


@given(days, st.integers(0, 255))
def test_a_key_or_an_anchor_with_one_other_bit_is_refused(day, bit):
    link = disclosed(day).holding.link
    assert not ANCHOR.holds(flipped(link, bit), day)
    assert not replace(ANCHOR, value=flipped(ANCHOR.value, bit)).holds(link, day)


@pytest.mark.long
def test_of_a_million_altered_keys_and_anchors_none_passes():
    day = FIRST + timedelta(1)
    link, tree = disclosed(day).holding.link, tree_of("fake-fleet", SCHEME)
    epoch = epoch_of_day(day, SCHEME)
    steps = range(epoch, epoch - 2, -1)
    assert reaches(tree, link, steps, ANCHOR.value)
    right, anchor = int.from_bytes(link, "big"), int.from_bytes(ANCHOR.value, "big")
    masks = [1 << one | (1 << other if other < one else 0) for one in range(256) for other in range(256)]
    masks += [3 * number + 1 << number % 200 for number in range(500_000 - len(masks))]
    for mask in masks:
        assert not reaches(tree, (right ^ mask).to_bytes(32, "big"), steps, ANCHOR.value)
        assert not reaches(tree, link, steps, (anchor ^ mask).to_bytes(32, "big"))


def test_the_anchor_is_not_a_day_and_shows_no_later_one():
    # A day before the first is the anchor itself, which everybody has.
    assert not ANCHOR.holds(ANCHOR.value, FIRST)
    held = disclosed(FIRST).holding
    early = replace(held.grant, first_day=FIRST - timedelta(1), last_day=FIRST - timedelta(1))
    with pytest.raises(MtmError, match="the anchor is for"):
        ANCHOR.verified(replace(disclosed(FIRST), secret=replace(held, grant=early)))


def test_earlier_days_follow_from_a_disclosed_one_and_later_not():

    tree, day = tree_of("fake-fleet", SCHEME), FIRST + timedelta(100)
    link = disclosed(day).holding.link
    epoch = disclosed(day).holding.grant.epochs(SCHEME)[0]
    assert tree.earlier(link, epoch) == disclosed(day - timedelta(1)).holding.link
    assert tree.earlier(link, epoch) != disclosed(day + timedelta(1)).holding.link


def test_a_day_is_not_given_out_before_it_is_over():
    day = date(2026, 3, 1)
    over = datetime(2026, 3, 2, tzinfo=UTC)
    for now in (over - timedelta(hours=9), over, over + timedelta(minutes=59, seconds=59)):
        with pytest.raises(MtmError, match="not to be disclosed before 2026-03-02 01:00 UTC"):
            disclosed_key(MASTER, day, now)
    assert disclosed_key(MASTER, day, over + timedelta(hours=1)).holding.link
    assert ANCHOR.disclosed_from(day) == over + timedelta(hours=1)


def test_files_are_public_and_read_back(tmp_path):
    day = date(2026, 3, 1)
    save_anchor(ANCHOR, tmp_path / "fleet.anchor")
    save_disclosed(disclosed(day), tmp_path / "day.key")
    assert all(path.stat().st_mode & 0o777 == 0o644 for path in tmp_path.iterdir())
    anchor = load_anchor(tmp_path / "fleet.anchor")
    assert anchor == ANCHOR
    key = load_disclosed(tmp_path / "day.key", anchor)
    assert key.holding.link == disclosed(day).holding.link
    assert MASTER.holding.master.hex() not in (tmp_path / "fleet.anchor").read_text()
    with pytest.raises(MtmError, match="exists already"):
        save_anchor(ANCHOR, tmp_path / "fleet.anchor")


def test_what_does_not_belong_together_is_refused(tmp_path):
    save_anchor(ANCHOR, tmp_path / "fleet.anchor")
    other = generate_master("fake-fleet", SCHEME, FIRST, 365)
    save_disclosed(disclosed_key(other, FIRST, LATER), tmp_path / "other.key")
    named = generate_master("other-fleet", SCHEME, FIRST, 365)
    save_disclosed(disclosed_key(named, FIRST, LATER), tmp_path / "named.key")
    anchor = load_anchor(tmp_path / "fleet.anchor")
    with pytest.raises(MtmError, match="is not the one of 2026-01-01"):
        load_disclosed(tmp_path / "other.key", anchor)
    with pytest.raises(MtmError, match="of other-fleet and the anchor of fake-fleet"):
        load_disclosed(tmp_path / "named.key", anchor)
    with pytest.raises(MtmError, match="it is no disclosed key"):
        load_disclosed(tmp_path / "fleet.anchor", anchor)
    with pytest.raises(MtmError, match="it is no anchor"):
        load_anchor(tmp_path / "other.key")
    with pytest.raises(MtmError, match="can be read by others"):
        load_key(tmp_path / "other.key")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("margin_s = 3600", "margin_s = 0", "margin_s must be"),
        ('anchor = "', 'anchor = "z', "64 hexadecimal"),
        ("first_day = 2026-01-01", "first_day = 2029-01-01", "in order"),
        ('id = "fake-fleet"', "id = 7", "name or scheme"),
        ('kind = "anchor"', 'kind = "robot"', "it is no anchor"),
        ("[scheme]", "[scheme", "not valid TOML"),
    ],
)
def test_a_bad_anchor_says_what_to_change(tmp_path, old, new, says):
    path = tmp_path / "fleet.anchor"
    save_anchor(ANCHOR, path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(MtmError, match=says):
        load_anchor(path)


def test_only_a_master_has_an_anchor_and_days_to_disclose():
    for key in (generate_key("a", small_scheme()), Key("a", FAKE_SECRET, SCHEME)):
        with pytest.raises(MtmError, match="from a master"):
            anchor_of(key)
        with pytest.raises(MtmError, match="from the master"):
            disclosed_key(key, FIRST, LATER)
    with pytest.raises(MtmError, match="this master is for"):
        disclosed_key(MASTER, date(2025, 1, 1), LATER)
    # Changing a bit of a fingerprint is another chain.
    assert not replace(ANCHOR, scheme=replace(SCHEME, name="x")).holds(disclosed(FIRST).holding.link, FIRST)


def flipped(value: bytes, bit: int) -> bytes:
    return (int.from_bytes(value, "big") ^ 1 << bit).to_bytes(32, "big")
