"""Robots with files of their own, read by auditors with files of theirs."""

from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from functools import cache

import numpy as np
import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.recorded_at import RecordedAt
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.protocol.framing import Framing, decode_frame, frame_order
from mtm_onboard.protocol.framing.slot_mask import slot_mask
from mtm_onboard.protocol.key import generate_master
from mtm_onboard.protocol.master import MasterHolding
from mtm_onboard.protocol.slots import epoch_of_slot, slot_at
from mtm_onboard.runtime.message import message_of
from tests.audit.moving_robot import FAKE_SECRET, robot_track, scheme_of

TAGGED = Framing("integer", 12, number_bits=4, check="tag", check_bits=20, code="reed-solomon", interleave=True)
# Two robots with six windows of 2 s each: 36 bits of data in nine of twelve symbols.
SCHEME = scheme_of(symbols=(6, 6), ticks=600, alphabet=16, framing=TAGGED, schedule="rolling")
MONDAY = date(2026, 11, 30)
NOON_S = datetime(2026, 11, 30, 12, tzinfo=UTC).timestamp()


@cache
def master() -> MasterHolding:
    made = generate_master("fake-fleet", SCHEME, MONDAY - timedelta(3), 10).holding
    return replace(made, master=FAKE_SECRET)


def auditor(day=MONDAY, days=1) -> Key:
    return Key("fake-fleet", master().for_auditor(day, day + timedelta(days - 1)), SCHEME)


def robot(channel: str, day=MONDAY) -> Key:
    return Key("fake-fleet", master().for_robot([channel], day, day), SCHEME)


@cache
def tracks(payload=1234, start_s=NOON_S, seconds=26.0, keys=None):
    """Two robots with a file each, from a slot's start on; the recording begins a second earlier."""
    held = keys or (robot("robot0"), robot("robot1"))
    slot = slot_at(start_s, SCHEME)
    return tuple(
        robot_track(key, f"robot{n}", message_of(payload, key, 3), seconds, onset_s=1.0, seed=n, first_slot=slot)
        for n, key in enumerate(held)
    )


def decoded(sent, key, at_s=NOON_S - 1.0, error_s=2.0):
    return decode_tracks(sent, key, DecodeSettings(at=RecordedAt(at_s, error_s)))


def test_an_auditor_reads_robots_that_have_their_own_files():
    decoding = decoded(tracks(), auditor())
    assert (decoding.verdict, decoding.message) == ("decoded", 1234)
    message = decoding.frames[0].message
    assert message.authenticated
    assert message.number == 3


def test_repeats_of_a_frame_add_up_under_their_masks(monkeypatch):
    sent = tracks(seconds=38.0)
    decoding = decoded(sent, auditor())
    first, last = decoding.frames[0].slots
    assert last - first == 3
    # Symbols of all slots agree, each by itself.
    assert (decoding.verdict, decoding.uncertain) == ("decoded", ())
    monkeypatch.setattr("mtm_audit.decoding.frames.slot_mask", lambda scheme, holding, slot: None)
    assert decoded(sent, auditor()).verdict == "inconclusive"


def test_an_auditor_of_monday_reads_nothing_of_tuesday():
    with pytest.raises(MtmError, match="is for 2026-11-30 and not for 2026-12-01"):
        decoded(tracks(start_s=NOON_S + 86_400.0), auditor(), NOON_S + 86_399.0)


def test_a_robot_s_file_reads_no_other_robot():
    with pytest.raises(MtmError, match="for robot0 and not for robot1"):
        decoded(tracks(), robot("robot0"))


def test_a_frame_holds_in_its_own_slot_alone():
    key = robot("robot0")
    slot = slot_at(NOON_S, SCHEME)
    epoch = epoch_of_slot(slot, SCHEME)[0]
    played = message_of(77, key).symbols(slot)

    def read_as(other: int) -> int:
        frame = np.empty(len(played), dtype=np.int64)
        frame[frame_order(SCHEME, slot)] = played
        mask = slot_mask(SCHEME, key.holding, other)
        return decode_frame((frame ^ mask).tolist(), SCHEME, key.holding.tag_key(epoch), epoch=epoch).payload

    assert read_as(slot) == 77
    for other in (slot - 1, slot + 1, slot + 100):
        with pytest.raises(MtmError, match="read them again"):
            read_as(other)


def test_another_fleet_s_master_reads_nothing():
    other = replace(master(), master=b"one more fake secret, only tests")
    key = Key("fake-fleet", other.for_auditor(MONDAY, MONDAY), SCHEME)
    assert decoded(tracks(), key).verdict == "absent"


def test_a_film_over_midnight_is_read_with_a_file_for_both():
    midnight_s = datetime(2026, 12, 1, tzinfo=UTC).timestamp()
    slot = slot_at(midnight_s - 12.0, SCHEME)
    held = Key("fake-fleet", master().for_robot(["robot0", "robot1"], MONDAY, MONDAY + timedelta(1)), SCHEME)
    sent = tracks(start_s=slot * 12.0, keys=(held, held))
    decoding = decoded(sent, auditor(days=2), slot * 12.0 - 1.0)
    assert (decoding.verdict, decoding.message) == ("decoded", 1234)
    assert {frame.message.epoch - SCHEME.epoch for frame in decoding.frames} == {20_787, 20_788}
