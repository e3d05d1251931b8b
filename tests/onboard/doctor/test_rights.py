from dataclasses import replace
from datetime import UTC, date, datetime, timedelta

import pytest

from mtm_onboard.doctor.rights import check_grant, check_state
from mtm_onboard.journal.ledger import Ledger
from mtm_onboard.protocol import Channel, Key, Scheme
from mtm_onboard.protocol.master import new_master

MONDAY = date(2026, 11, 30)
NOON = datetime(2026, 11, 30, 12, tzinfo=UTC)
SCHEME = Scheme(
    name="fake", rate_hz=50.0, band_hz=(0.5, 5.0), alphabet_size=4, message_ticks=200, schedule="rolling",
    channels=tuple(Channel(name, name, ("vx", "vy"), 2, 0.1) for name in ("robot0", "robot1")),
)  # fmt: skip
MASTER = new_master("fake", SCHEME, MONDAY, 30)


def robot_key(days=30, not_after=None):
    return Key("fake", MASTER.for_robot(["robot0"], MONDAY, MONDAY + timedelta(days - 1), not_after), SCHEME)


def test_a_robot_s_file_of_today_passes_and_says_how_long():
    found = check_grant(robot_key(), NOON)
    assert (found.status, found.figures) == ("pass", {"days_left": 29.5})
    assert "robot0" in found.text


@pytest.mark.parametrize(
    ("held", "says"),
    [(bytes(32), "format 1"), (MASTER, "is a master"), (MASTER.for_auditor(MONDAY, MONDAY), "no robot's file")],
)
def test_a_file_that_is_no_robot_s_is_a_warning(held, says):
    found = check_grant(Key("fake", held, SCHEME), NOON)
    assert found.status == "warn"
    assert says in found.text


def test_a_file_that_is_soon_over_is_a_warning():
    assert check_grant(robot_key(days=3), NOON).status == "warn"
    assert check_grant(robot_key(not_after=NOON + timedelta(2)), NOON).status == "warn"


@pytest.mark.parametrize("later", [timedelta(-1), timedelta(30)])
def test_a_file_of_other_days_is_a_failure(later):
    found = check_grant(robot_key(), NOON + later)
    assert found.status == "fail"
    assert "today is none" in found.text


def test_an_expired_file_is_a_failure():
    assert "expired" in check_grant(robot_key(not_after=NOON - timedelta(hours=1)), NOON).text


def test_a_ledger_that_can_be_kept_passes_and_nothing_is_left(tmp_path):
    assert check_state(tmp_path / "robot.state", robot_key()).status == "pass"
    assert list(tmp_path.iterdir()) == []


def test_a_ledger_that_is_there_is_left_as_it_was(tmp_path):
    path, key = tmp_path / "robot.state", robot_key()
    with Ledger(path, key.id, SCHEME.fingerprint) as ledger:
        ledger.reserve(7_000_000)
    before = path.read_bytes()
    assert "slots up to 7000000 are not played again" in check_state(path, key).text
    assert path.read_bytes() == before


def test_a_ledger_that_is_damaged_or_in_use_is_a_failure(tmp_path):
    path, key = tmp_path / "robot.state", robot_key()
    with Ledger(path, key.id, SCHEME.fingerprint):
        assert "another run" in check_state(path, key).text
    path.write_text("format = 1\nkeys = 3\n")
    found = check_state(path, key)
    assert (found.status, "damaged" in found.text) == ("fail", True)
    assert path.read_text() == "format = 1\nkeys = 3\n"


def test_only_the_rolling_schedule_must_have_a_ledger(tmp_path):
    assert check_state(None, robot_key()).status == "fail"
    assert check_state(None, Key("fake", bytes(32), replace(SCHEME, schedule="fixed"))).status == "pass"
    assert check_state(tmp_path / "nowhere" / "robot.state", robot_key()).status == "fail"
