"""`mtm-audit decode` with an auditor's file, with a disclosed key, and with lists of revoked files."""

import json
import os
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta

import numpy as np
import pytest

from hil.sensors.motion_capture import write_tum
from mtm_audit.cli import main
from mtm_onboard.cli import main as onboard
from mtm_onboard.protocol import Key, save_key
from mtm_onboard.protocol.disclosure import anchor_of, disclosed_key, save_anchor, save_disclosed
from tests.audit.decoding.test_key_tree_decode import MONDAY, SCHEME, auditor, master, tracks

AT = ("--at", "2026-11-30T11:59:59Z", "--at-error", "2")
PUBLIC_FROM = datetime(2026, 12, 1, 1, tzinfo=UTC)
LATER = datetime(2026, 12, 24, tzinfo=UTC)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("format2")
    (path / "sent").mkdir()
    for track in tracks():
        seen = replace(track, headings_rad=np.zeros(len(track.times_s)))
        write_tum(seen, path / "sent" / f"{track.name}.tum")
    whole = Key("fake-fleet", master(), SCHEME)
    save_key(whole, path / "fleet.master")
    save_key(auditor(), path / "auditor.key")
    save_key(auditor(date(2026, 12, 1)), path / "tuesday.key")
    save_anchor(anchor_of(whole), path / "fleet.anchor")
    for day in (MONDAY, MONDAY + timedelta(1)):
        save_disclosed(disclosed_key(whole, day, LATER), path / f"{day}.key")
    return path


@pytest.fixture
def audit(folder, capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main(["decode", str(folder / "sent"), *map(str, arguments)])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code or 0, out, err

    return run


def written(folder, when: datetime) -> None:
    for path in (folder / "sent").iterdir():
        os.utime(path, (when.timestamp(), when.timestamp()))


def public(folder, day=MONDAY):
    return "--anchor", folder / "fleet.anchor", "--disclosed", folder / f"{day}.key"


def test_an_auditor_reads_and_is_told_who_can_make_such_a_motion(audit, folder):
    code, out, err = audit("--key", folder / "auditor.key", *AT)
    assert (code, err) == (0, "")
    assert "decoded: message 1234" in out
    assert "This motion can be made by who holds a file of its day: the robots of robot0, robot1" in out
    assert "warning: key" not in out


def test_a_master_reads_with_a_warning(audit, folder):
    code, out, _ = audit("--key", folder / "fleet.master", *AT)
    assert code == 0
    assert "warning: key fake-fleet is a master" in out


def test_an_auditor_of_tuesday_cannot_read_monday(audit, folder):
    code, out, err = audit("--key", folder / "tuesday.key", *AT)
    assert (code, out) == (1, "")
    assert "is for 2026-12-01 and not for 2026-11-30" in err


@pytest.mark.parametrize(
    ("written_at", "stated", "says", "authentic"),
    [
        (
            PUBLIC_FROM - timedelta(hours=2),
            True,
            "This copy was last written on 2026-11-30 23:00 UTC, before that",
            True,
        ),
        (LATER, True, "rests on --at alone: this copy was last written on 2026-12-24 00:00 UTC", True),
    ],
)
def test_everybody_verifies_a_film_of_a_disclosed_day(audit, folder, written_at, stated, says, authentic):
    written(folder, written_at)
    code, out, _ = audit(*public(folder), *AT, "--json")
    report = json.loads(out)
    assert (code, report["message"]) == (0, 1234)
    (told,) = report["rests_on"]
    assert "may be public since 2026-12-01 01:00 UTC. A film made after that proves nothing" in told
    assert says in told
    assert report["frames"][0]["authenticated"] is authentic


def test_a_film_of_another_day_than_the_disclosed_is_not_read(audit, folder):
    code, out, err = audit(*public(folder, MONDAY + timedelta(1)), *AT)
    assert (code, out) == (1, "")
    assert "is for 2026-12-01 and not for 2026-11-30" in err
    code, _, err = audit(*public(folder), "--at", "2026-12-02T11:59:59Z", "--at-error", "2")
    assert code == 1
    assert "the film is from after 2026-12-01 01:00 UTC, when the disclosed key was public" in err
    assert "it proves nothing" in err


@pytest.mark.parametrize(
    "options",
    [(), ("--disclosed",), ("--key", "--anchor"), ("--key", "--disclosed"), ("--key", "--anchor", "--disclosed")],
)
def test_a_key_or_an_anchor_with_a_disclosed_key_is_usage(audit, folder, options):
    given = [part for option in options for part in (option, folder / "auditor.key")]
    code, out, err = audit(*given, *AT)
    assert (code, out) == (2, "")
    told = " ".join(err.replace("│", " ").split())
    assert "give a key file, or else an anchor with a disclosed key or alone" in told


def test_a_revoked_robot_authenticates_nothing_any_more(audit, folder, tmp_path, capsys):
    listed = tmp_path / "fleet.revoked"
    revoke = ["revoke", "--list", str(listed), "--serial", "0123456789abcdef", "--channel", "robot1"]
    assert onboard([*revoke, "--since", "2026-11-30T11:00:00Z"]) == 0
    capsys.readouterr()
    code, out, _ = audit("--key", folder / "auditor.key", *AT, "--revoked", listed, "--json")
    report = json.loads(out)
    assert (code, report["message"], report["frames"][0]["authenticated"]) == (0, 1234, False)
    assert any("Not authenticated: the key file of robot1 was revoked by then" in told for told in report["rests_on"])
    text = audit("--key", folder / "auditor.key", *AT, "--revoked", listed)[1]
    assert "Authenticated:" not in text


def test_before_the_theft_the_robot_is_believed(audit, folder, tmp_path, capsys):
    listed = tmp_path / "fleet.revoked"
    revoke = ["revoke", "--list", str(listed), "--serial", "0123456789abcdef", "--channel", "robot1"]
    assert onboard([*revoke, "--since", "2026-11-30T13:00:00Z"]) == 0
    capsys.readouterr()
    out = audit("--key", folder / "auditor.key", *AT, "--revoked", listed)[1]
    assert "Authenticated:" in out


def test_a_revoked_auditor_reads_nothing(audit, folder, tmp_path):
    serial = auditor_serial(folder)
    listed = tmp_path / "fleet.revoked"
    assert onboard(["revoke", "--list", str(listed), "--serial", serial]) == 0
    code, _, err = audit("--key", folder / "auditor.key", *AT, "--revoked", listed)
    assert code == 1
    assert f"serial {serial}, was revoked" in err


def test_an_expired_file_reads_nothing(audit, tmp_path):
    held = master().for_auditor(MONDAY, MONDAY, datetime(2026, 1, 1, tzinfo=UTC))
    save_key(Key("fake-fleet", held, SCHEME), tmp_path / "old.key")
    code, _, err = audit("--key", tmp_path / "old.key", *AT)
    assert code == 1
    assert "expired on 2026-01-01 at 00:00:00 UTC" in err


def auditor_serial(folder) -> str:
    (line,) = [line for line in (folder / "auditor.key").read_text().splitlines() if line.startswith("serial")]
    return line.split('"')[1]
