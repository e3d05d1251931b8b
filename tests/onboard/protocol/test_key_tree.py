"""The key tree against an independent reference, and who can compute what."""

import json
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import Channel, Codebook, Key, MtmError, Scheme, load_key, save_key
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.holding import day_of_epoch, epoch_of_day
from mtm_onboard.protocol.key import generate_key, generate_master, key_text
from mtm_onboard.protocol.key_tree import Tree, tree_of
from mtm_onboard.protocol.master import MasterHolding
from mtm_onboard.protocol.slots import epoch_of_slot, slot_at
from mtm_onboard.protocol.tag_key import TagKey
from mtm_onboard.protocol.waveform import draw_tones, evaluate_window, phasors, tone_bins

VECTORS = json.loads((Path(__file__).parent / "key_tree_v2.json").read_text())
MONDAY = date(2026, 11, 30)
TUESDAY = MONDAY + timedelta(1)
SCHEME = Scheme(
    name="test",
    rate_hz=50.0,
    band_hz=(0.5, 5.0),
    alphabet_size=16,
    message_ticks=600,
    channels=(Channel("robot0", "robot0", ("vx", "vy"), 6, 0.1), Channel("robot1", "robot1", ("vx",), 6, 0.1)),
    schedule="rolling",
    framing=Framing("integer", 8, number_bits=4, check="tag", check_bits=32),
)
MASTER = generate_master("fake-fleet", SCHEME, MONDAY, 30)
HOLDING = MASTER.holding


def noon_slot(day: date) -> int:
    return slot_at((epoch_of_day(day, SCHEME) - SCHEME.epoch) * 86_400.0 + 43_200.0, SCHEME)


def samples(key: Key, channel: int, day: date):
    return key.codebook(noon_slot(day)).samples(SCHEME.channels[channel], 0, [3])


def test_every_value_of_the_tree_is_that_of_the_reference():
    tree = Tree(VECTORS["key_id"], VECTORS["fingerprint"])
    links = dict(tree.chain(bytes.fromhex(VECTORS["master"]), VECTORS["first"], VECTORS["last"]))
    assert links[VECTORS["first"] - 1].hex() == VECTORS["anchor"]
    for vector in VECTORS["days"]:
        day = vector["day"]
        secret = tree.day_secret(links[day], day)
        assert (links[day].hex(), secret.hex()) == (vector["link"], vector["secret"])
        assert [tree.channel_secret(secret, day, channel).hex() for channel in range(3)] == vector["channels"]
        tags = tree.tags_secret(secret, day)
        assert tags.hex() == vector["tags"]
        tag_key = TagKey(tags, (tree.number, *tree.id_words, 0b111))
        assert tag_key.tag(day, 5, (0x0123456789ABCDEF,), 32) == vector["tag_of_number_5"]
        assert tag_key.slot_pad(day, 77, 32) == vector["pad_of_slot_77"]


def test_a_channel_s_waveform_is_that_of_the_reference():
    vector = VECTORS["waveform"]
    secret = bytes.fromhex(VECTORS["days"][2]["channels"][1])
    bins = tone_bins(vector["ticks"], float(vector["rate_hz"]), tuple(map(float, vector["band_hz"])))
    drawn = draw_tones(secret, vector["day"], vector["window"], vector["symbol"], vector["axis"], len(bins))
    played = evaluate_window(phasors(*drawn, "window"), bins, vector["ticks"])
    assert played == pytest.approx(np.array(vector["samples"], float), abs=1e-12)


def test_robot_and_auditor_have_the_waveforms_of_the_master():
    robot = Key("fake-fleet", HOLDING.for_robot(["robot1"], MONDAY, TUESDAY), SCHEME)
    auditor = Key("fake-fleet", HOLDING.for_auditor(MONDAY, MONDAY), SCHEME)
    for key in (robot, auditor):
        assert np.array_equal(samples(key, 1, MONDAY), samples(MASTER, 1, MONDAY))
        epoch = epoch_of_day(MONDAY, SCHEME)
        assert key.holding.tag_key(epoch) == HOLDING.tag_key(epoch)
    assert np.array_equal(samples(auditor, 0, MONDAY), samples(MASTER, 0, MONDAY))


def test_no_two_days_and_channels_share_a_waveform():
    days = [MONDAY, TUESDAY]
    drawn = [samples(MASTER, channel, day)[0, 0] for channel in (0, 1) for day in days]
    correlations = np.corrcoef(drawn) - np.eye(4)
    assert np.max(np.abs(correlations)) < 0.6


def test_a_robot_cannot_speak_for_another():
    robot = Key("fake-fleet", HOLDING.for_robot(["robot1"], MONDAY, TUESDAY), SCHEME)
    with pytest.raises(MtmError, match="for robot1 and not for robot0"):
        samples(robot, 0, MONDAY)


@pytest.mark.parametrize("day", [MONDAY - timedelta(1), TUESDAY])
def test_a_file_of_monday_has_nothing_of_other_days(day):
    for held in (HOLDING.for_auditor(MONDAY, MONDAY), HOLDING.for_robot(["robot0"], MONDAY, MONDAY)):
        key = Key("fake-fleet", held, SCHEME)
        with pytest.raises(MtmError, match=f"is for {MONDAY} and not for {day}"):
            samples(key, 0, day)
        with pytest.raises(MtmError, match=f"is for {MONDAY} and not for {day}"):
            held.tag_key(epoch_of_day(day, SCHEME))


def test_the_tree_is_bound_to_scheme_and_name():
    louder = replace(SCHEME, name="other")
    foreign = MasterHolding(HOLDING.grant, tree_of("fake-fleet", louder), louder, HOLDING.master)
    renamed = MasterHolding(HOLDING.grant, tree_of("other-fleet", SCHEME), SCHEME, HOLDING.master)
    epoch = epoch_of_day(MONDAY, SCHEME)
    secrets = {held.channel_secret(epoch, 0) for held in (HOLDING, foreign, renamed)}
    assert len(secrets) == 3


def test_files_of_every_kind_are_read_back(tmp_path):
    held = {
        "master": HOLDING,
        "auditor": HOLDING.for_auditor(MONDAY, TUESDAY),
        "robot": HOLDING.for_robot(["robot1", "robot0"], MONDAY, TUESDAY),
        "disclosed": HOLDING.disclosed(MONDAY),
    }
    for kind, holding in held.items():
        path = tmp_path / kind
        save_key(Key("fake-fleet", holding, SCHEME), path)
        loaded = load_key(path)
        assert loaded.holding.grant == holding.grant
        assert loaded.scheme == SCHEME
        assert key_text(loaded) == path.read_text()
        assert np.array_equal(samples(loaded, 1, MONDAY), samples(MASTER, 1, MONDAY))


def test_no_secret_is_shown():
    for held in (HOLDING, HOLDING.for_auditor(MONDAY, MONDAY), HOLDING.for_robot(["robot0"], MONDAY, MONDAY)):
        key = Key("fake-fleet", held, SCHEME)
        for line in key_text(key).splitlines():
            digits = line.strip(' ",').removeprefix('secret = "')
            assert len(digits) != 64 or digits not in repr(key)
        assert "bytes" not in repr(key)
        assert "\\x" not in repr(key)


@pytest.mark.parametrize(
    ("kind", "old", "new", "says"),
    [
        ("auditor", 'kind = "auditor"', 'kind = "king"', "the kind is 'king'"),
        ("auditor", "first_day = 2026-11-30", "first_day = 2026-11-29", "one secret for each day"),
        ("auditor", "first_day = 2026-11-30", "first_day = 2027-11-30", "give them in order"),
        ("auditor", "first_day = 2026-11-30", "first_day = 1926-11-30", "before 1970"),
        ("auditor", "first_day = 2026-11-30", "first_day = 7", "is no day"),
        ("auditor", "first_day = 2026-11-30", "first_day = 2026-11-30T00:00:00", "is no day"),
        ("auditor", "last_day = 2026-12-01", "last_day = 9999-12-01", "more than 36525 days"),
        ("auditor", "serial = ", "serial = 7 # ", "sixteen hexadecimal"),
        ("auditor", 'schedule = "rolling"', 'schedule = "fixed"', 'need schedule = "rolling"'),
        ("auditor", "last_day", "colour", "unknown field 'colour'"),
        ("robot", 'channels = ["robot1"]', 'channels = ["robot7"]', "no channel 'robot7'"),
        ("robot", 'channels = ["robot1"]', "channels = []", "a list of names"),
        ("robot", 'channels = ["robot1"]', 'channels = ["robot1", "robot1"]', "names one twice"),
        ("robot", 'channels = ["robot1"]', 'channels = ["robot1", "robot0"]', "one list for each channel"),
        ("robot", "first_day", "not_after = 7\nfirst_day", "date and time with its offset"),
        ("robot", "first_day", "not_after = 2026-11-30T00:00:00\nfirst_day", "date and time with its offset"),
    ],
)
def test_a_bad_file_says_what_to_change(tmp_path, kind, old, new, says):
    issued = {
        "auditor": lambda: HOLDING.for_auditor(MONDAY, TUESDAY),
        "robot": lambda: HOLDING.for_robot(["robot1"], MONDAY, TUESDAY),
    }
    path = tmp_path / "a.key"
    save_key(Key("fake-fleet", issued[kind](), SCHEME), path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(MtmError, match=says) as refusal:
        load_key(path)
    assert "\n" not in str(refusal.value)


@given(data=st.data())
def test_a_damaged_file_is_refused_in_one_sentence(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("key")
    issued = [HOLDING.for_auditor(MONDAY, TUESDAY), HOLDING.for_robot(["robot1"], MONDAY, MONDAY)]
    held = data.draw(st.sampled_from(issued))
    text = key_text(Key("fake-fleet", held, SCHEME))
    place = data.draw(st.integers(0, len(text) - 1))
    kept = data.draw(st.sampled_from(["", "x", '"', "]", "7\n"]))
    path = folder / "a.key"
    path.write_text(text[:place] + kept + text[place + 1 :])
    path.chmod(0o600)
    try:
        load_key(path)
    except MtmError as error:
        said = str(error)
        assert "\n" not in said
        for line in text.splitlines():
            assert len(line.strip(' ",')) != 64 or line.strip(' ",') not in said


@given(st.dates(date(1970, 1, 1), date(2400, 1, 1)), st.integers(0, 10**6))
def test_a_day_is_the_epoch_of_its_slots(day, epoch):
    scheme = replace(SCHEME, epoch=epoch)
    number = epoch_of_day(day, scheme)
    assert day_of_epoch(number, scheme) == day
    slot = slot_at((number - epoch) * 86_400.0 + 50.0, scheme)
    assert epoch_of_slot(slot, scheme)[0] == number


def test_the_last_slot_is_the_last_that_starts_in_the_span():
    held = HOLDING.for_auditor(MONDAY, TUESDAY)
    last = held.grant.last_slot(SCHEME)
    assert [day_of_epoch(epoch_of_slot(slot, SCHEME)[0], SCHEME) for slot in (last, last + 1)] == [
        TUESDAY, TUESDAY + timedelta(1),
    ]  # fmt: skip
    assert Codebook(held, SCHEME).last_slot == last
    assert Codebook(b"not a real secret, only for test", SCHEME).last_slot is None


def test_new_keys_of_a_rolling_schedule_are_masters():
    assert generate_key("a", SCHEME).holding.grant.kind == "master"
    assert generate_key("a", replace(SCHEME, schedule="fixed")).holding.grant is None
    with pytest.raises(MtmError, match='make the schedule "rolling"'):
        generate_master("a", replace(SCHEME, schedule="fixed"), MONDAY, 3)
    with pytest.raises(MtmError, match="1 to 36525 days"):
        generate_master("a", SCHEME, MONDAY, 0)
    with pytest.raises(MtmError, match="this master is for"):
        HOLDING.for_auditor(MONDAY - timedelta(1), MONDAY)
    with pytest.raises(MtmError, match="in order"):
        HOLDING.for_auditor(TUESDAY, MONDAY)
