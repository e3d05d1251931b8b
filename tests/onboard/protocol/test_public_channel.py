"""The public channel: everybody with the anchor has its waveforms, and only a day that is over is said on it."""

import hashlib
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mtm_onboard.protocol import Channel, MtmError, load_key
from mtm_onboard.protocol.disclosure import anchor_of, disclosed_key, load_anchor, save_anchor, save_disclosed
from mtm_onboard.protocol.framing.framing import layout_of
from mtm_onboard.protocol.holding import epoch_of_day
from mtm_onboard.protocol.key import generate_master
from mtm_onboard.protocol.public_channel import carried_key, link_to_carry, public_key, public_scheme
from mtm_onboard.runtime.message import message_of
from tests.onboard.schemes import small_scheme

CHANNELS = tuple(Channel(name, name, ("vx", "vy"), 3, 0.1) for name in "abcd")
SCHEME = small_scheme(schedule="rolling", alphabet_size=16, message_ticks=600, channels=CHANNELS)
FIRST = date(2026, 1, 1)
MASTER = generate_master("fake-fleet", SCHEME, FIRST, 500)
ANCHOR = anchor_of(MASTER)
LATER = datetime(2028, 6, 1, tzinfo=UTC)
days = st.integers(0, 499).map(lambda number: FIRST + timedelta(number))


def link_of(day: date) -> bytes:
    return disclosed_key(MASTER, day, LATER).holding.link


def test_a_day_s_key_takes_eight_messages_of_four_robots():
    public = public_scheme(SCHEME)
    assert public.message_ticks / public.rate_hz == 96.0
    assert 256 / 96.0 > 2.0
    layout = layout_of(public.framing, public.alphabet_size, public.message_symbols)
    # One robot of the four carries twelve of the 48 code symbols, and is made good when it is out of sight.
    assert (layout.code_symbols, layout.parity) == (48, 13)


@given(
    st.integers(1, 6), st.integers(1, 12), st.integers(2, 300), st.sampled_from(["split", "same"]), st.integers(20, 40)
)
def test_windows_and_noise_stay_the_fleet_s(channels, symbols, alphabet_size, combine, window_ticks):
    names = [f"r{number}" for number in range(channels)]
    scheme = replace(
        SCHEME, alphabet_size=alphabet_size, combine=combine, message_ticks=window_ticks * symbols,
        channels=tuple(Channel(name, name, ("vx",), symbols, 0.1) for name in names), band_hz=(2.0, 20.0),
    )  # fmt: skip
    public = public_scheme(scheme)
    for own, theirs in zip(public.channels, scheme.channels, strict=True):
        assert public.window_ticks(own) == scheme.window_ticks(theirs)
        assert replace(own, symbols=theirs.symbols) == theirs
    assert (public.rate_hz, public.band_hz) == (scheme.rate_hz, scheme.band_hz)
    layout = layout_of(public.framing, public.alphabet_size, public.message_symbols)
    assert layout.parity >= 0.25 * layout.code_symbols


def test_the_anchor_alone_makes_its_waveforms(tmp_path):
    save_anchor(ANCHOR, tmp_path / "fleet.anchor")
    robot, auditor = public_key(ANCHOR), public_key(load_anchor(tmp_path / "fleet.anchor"))
    channel = robot.scheme.channels[2]
    slot = robot.holding.grant.first_slot(robot.scheme) + 4000
    played, known = (key.codebook(slot).samples(channel, 1, [3]) for key in (robot, auditor))
    np.testing.assert_array_equal(played, known)
    assert robot.warning is None


def test_its_secrets_are_those_of_the_anchor_s_stream():
    key = public_key(ANCHOR)
    number = int(key.scheme.fingerprint, 16)
    words = b"".join(value.to_bytes(8, "little") for value in (number, 20_500, 2))
    expected = hashlib.shake_256(ANCHOR.value + b"\x06public" + words).digest(32)
    assert key.holding.channel_secret(20_500, 2) == expected
    assert expected != MASTER.holding.channel_secret(epoch_of_day(FIRST, SCHEME), 2)


@settings(max_examples=12)
@given(days, st.integers(1, 366))
def test_what_later_days_carry_is_the_disclosed_key(day, later):
    key = carried_key(ANCHOR, link_of(day), day + timedelta(later))
    assert ANCHOR.verified(key) is key
    assert (key.holding.grant.first_day, key.holding.link) == (day, link_of(day))
    epoch = epoch_of_day(day, SCHEME)
    assert key.holding.channel_secret(epoch, 1) == MASTER.holding.channel_secret(epoch, 1)


@settings(max_examples=12)
@given(days, st.integers(0, 255))
def test_what_is_made_up_is_denied(day, bit):
    made_up = (int.from_bytes(link_of(day), "big") ^ 1 << bit).to_bytes(32, "big")
    with pytest.raises(MtmError, match="is no key of the anchor's chain"):
        carried_key(ANCHOR, made_up, day + timedelta(1))


@pytest.mark.parametrize("after", [-400, -1, 0, 367])
def test_a_key_of_no_earlier_day_of_the_year_is_denied(after):
    day = FIRST + timedelta(100)
    with pytest.raises(MtmError, match="everybody can play there"):
        carried_key(ANCHOR, link_of(day), day + timedelta(after))


def test_the_anchor_itself_is_no_day_s_key():
    with pytest.raises(MtmError, match="is no key"):
        carried_key(ANCHOR, ANCHOR.value, FIRST + timedelta(1))


def test_a_day_is_carried_once_its_margin_has_passed():
    day = date(2026, 3, 1)
    over, disclosed = datetime(2026, 3, 2, tzinfo=UTC), disclosed_key(MASTER, day, LATER)
    for now in (over - timedelta(hours=3), over, over + timedelta(minutes=59, seconds=59)):
        with pytest.raises(MtmError, match="2026-03-01 is not to be played before 2026-03-02 01:00 UTC"):
            link_to_carry(ANCHOR, disclosed, now)
    assert link_to_carry(ANCHOR, disclosed, over + timedelta(hours=1)) == link_of(day)


def test_only_a_key_of_the_chain_is_carried():
    other = generate_master("fake-fleet", SCHEME, FIRST, 500)
    with pytest.raises(MtmError, match="is not the one of"):
        link_to_carry(ANCHOR, disclosed_key(other, FIRST, LATER), LATER)


def test_the_message_is_the_same_bytes_in_every_slot():
    key = public_key(ANCHOR)
    message = message_of(link_of(FIRST), key)
    slot = key.holding.grant.first_slot(key.scheme) + 900
    assert sorted(message.symbols(slot)) == sorted(message.symbols(slot + 1))
    with pytest.raises(MtmError, match="this scheme carries 1 to 32 bytes"):
        message_of(bytes(33), key)


def test_a_key_can_be_carried_for_a_year_after_the_last_day():
    grant = public_key(ANCHOR).holding.grant
    assert (grant.kind, grant.last_day) == ("public", ANCHOR.last_day + timedelta(366))
    last = replace(ANCHOR, last_day=date.max)
    assert public_key(last).holding.grant.last_day == date.max


def test_no_key_file_is_of_the_public_kind(tmp_path):
    save_disclosed(disclosed_key(MASTER, FIRST, LATER), tmp_path / "day.key")
    text = (tmp_path / "day.key").read_text()
    (tmp_path / "made.key").write_text(text.replace('kind = "disclosed"', 'kind = "public"'))
    (tmp_path / "made.key").chmod(0o600)
    with pytest.raises(MtmError, match="the kind is 'public'"):
        load_key(tmp_path / "made.key")


def test_a_scheme_in_which_no_key_fits_says_so():
    tiny = replace(SCHEME, alphabet_size=2, message_ticks=3000, channels=(Channel("a", "a", ("vx",), 1, 0.1),))
    assert public_scheme(tiny).message_ticks > 3000
    long = replace(tiny, message_ticks=1 << 20)
    with pytest.raises(MtmError, match="does not fit"):
        public_scheme(long)
