"""`mtm-onboard run --anchor --disclosed`: a robot says a day's key, and not before it may be public."""

from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import pytest

from mtm_onboard.cli import main
from mtm_onboard.control import session
from mtm_onboard.control.control import Control
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.disclosure import anchor_of, disclosed_key, save_anchor, save_disclosed
from mtm_onboard.protocol.key import generate_master
from mtm_onboard.protocol.public_channel import public_key
from tests.onboard.schemes import small_scheme

CONFIG = """
[robot]
name = "r"
channel = "a"
[transport]
kind = "none"
[limits]
speed_mps = 1.0
turn_rate_radps = 2.0
[source]
kind = "stdin"
"""
TODAY = datetime.now(UTC).date()
OVER, UNDER_WAY = TODAY - timedelta(2), TODAY + timedelta(1)
MASTER = generate_master("fake-fleet", small_scheme(schedule="rolling"), TODAY - timedelta(9), 20)
LATER = datetime.now(UTC) + timedelta(20)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "robot.toml").write_text(CONFIG)
    save_anchor(anchor_of(MASTER), tmp_path / "fleet.anchor")
    for day in (OVER, UNDER_WAY):
        save_disclosed(disclosed_key(MASTER, day, LATER), tmp_path / f"{day}.key")
    return tmp_path


@pytest.fixture
def run(folder, monkeypatch, capsys):
    """Runs the command with a session that does not drive; returns its exit code, what it would play, and errors."""
    asked = []

    class Outcome:
        def summary(self):
            return "done"

    monkeypatch.setattr(session, "run_session", lambda *given, **_: asked.append(given) or Outcome())

    def of(*options):
        asked.clear()
        code = main(["run", "--config", str(folder / "robot.toml"), *map(str, options)])
        return code, asked, capsys.readouterr().err

    return of


def carried(folder, day=OVER):
    return "--anchor", folder / "fleet.anchor", "--disclosed", folder / f"{day}.key"


def test_a_robot_plays_the_key_of_a_day_that_is_over(run, folder):
    code, asked, err = run(*carried(folder), "--allow-unsynchronised")
    assert (code, err) == (0, "")
    ((_, key, plan, *_),) = asked
    assert key.holding.grant.kind == "public"
    assert plan.message == MASTER.holding.disclosed(OVER).link


def test_a_key_that_is_still_secret_is_never_played(run, folder):
    code, asked, err = run(*carried(folder, UNDER_WAY), "--allow-unsynchronised")
    assert (code, asked) == (1, [])
    assert f"the key of {UNDER_WAY} is not to be played before {UNDER_WAY + timedelta(1)} 01:00 UTC" in err


@pytest.mark.parametrize("word", [None, False])
def test_on_a_clock_that_nobody_keeps_right_none_is_played(run, folder, monkeypatch, word):
    monkeypatch.setattr("mtm_onboard.model.wall_clock.is_synchronised", lambda: word)
    code, asked, err = run(*carried(folder))
    assert (code, asked) == (1, [])
    assert "does not report this computer's clock as synchronised" in err
    monkeypatch.setattr("mtm_onboard.model.wall_clock.is_synchronised", lambda: True)
    assert run(*carried(folder))[0] == 0


@pytest.mark.parametrize(
    "options",
    [("--anchor", "a", "--message", "1"), ("--disclosed", "d"), ("--anchor", "a", "--disclosed", "d", "--key", "k"),
     ("--message", "1")],
)  # fmt: skip
def test_a_key_or_an_anchor_with_a_disclosed_key_is_usage(run, options, capsys):
    with pytest.raises(SystemExit) as left:
        run(*options)
    assert left.value.code == 2
    assert "give a key with a message, or else an anchor with a disclosed key" in capsys.readouterr().err


def test_a_run_that_plays_a_key_is_sent_nothing_else():
    standing = SimpleNamespace(key=public_key(anchor_of(MASTER)), guard=SimpleNamespace(stopped=False))
    with pytest.raises(MtmError, match="plays a disclosed key on the public channel and nothing else"):
        Control(standing).answer({"command": "send", "content": {"hex": "00" * 32}})
