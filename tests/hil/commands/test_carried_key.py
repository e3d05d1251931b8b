"""Two films and an anchor: a later day's robots carry the key with which a day's film is verified."""

import json
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace

import pytest

from hil.cli import main
from mtm_audit.cli import main as audit
from mtm_audit.commands.opened_key import OpenedKey
from mtm_audit.model.stage import StageError
from mtm_onboard.cli import main as onboard
from mtm_onboard.protocol.disclosure import load_anchor, load_disclosed
from mtm_onboard.protocol.public_channel import public_key
from mtm_onboard.protocol.slots import slot_at

# 128 bits in 8 s, so that a day's key takes 24 s.
SCHEME = (
    "--name", "lab", "--rate", "50", "--band", "0.5:5", "--alphabet", "256", "--message-ticks", "400",
    *(word for number in range(4) for word in ("--channel", f"robot{number}:vx,vy:4:0.1")),
    "--payload", "integer:32", "--check", "tag:32", "--code", "reed-solomon", "--interleave",
)  # fmt: skip
NOW = datetime.now(UTC)
# Two days ago, whose margin is over at any hour of today.
DAY = (NOW - timedelta(2)).date()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The film of a day, and that of today, whose robots carry the day's key; both of the same fleet."""
    path = tmp_path_factory.mktemp("carried")
    first = ("--first-day", str(DAY - timedelta(3)), "--days", "9")
    onboard_ok("keygen", "--id", "fleet", "--out", path / "fleet.master", *SCHEME, *first)
    master = ("--master", path / "fleet.master")
    onboard_ok("anchor", *master, "--out", path / "fleet.anchor")
    onboard_ok("disclose", *master, "--day", DAY, "--out", path / "given.key", "--allow-unsynchronised")
    quick = ("--wire", "direct", "--no-video")
    noon_s = datetime(DAY.year, DAY.month, DAY.day, 12, tzinfo=UTC).timestamp()
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("hil.commands.record.time.time", lambda: noon_s)
        recorded("--out", path / "then", "--key", path / "fleet.master", "--message", 1234, *quick, seconds="26")
    carried = ("--anchor", path / "fleet.anchor", "--disclosed", path / "given.key")
    (path / "at.txt").write_text(recorded("--out", path / "now", *carried, *quick, seconds="27"))
    return path


def onboard_ok(*arguments):
    assert onboard([str(word) for word in arguments]) == 0


def recorded(*arguments, seconds):
    """When the recording began, in the words of its truth."""
    with pytest.raises(SystemExit) as left:
        main(["record", *map(str, arguments), "--seconds", seconds])
    assert left.value.code == 0
    folder = Path(arguments[1])
    return datetime.fromtimestamp(json.loads((folder / "truth.json").read_text())["unix_s"], UTC).isoformat()


def at(text):
    return ("--at", text, "--at-error", "2")


@pytest.fixture
def decoded(capsys):
    def run(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as left:
            audit(["decode", *map(str, arguments)])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code or 0, out, err

    return run


@pytest.mark.slow
def test_two_films_and_an_anchor_verify_a_day(decoded, folder, tmp_path):
    """Nobody but the robots hands the key on: it is read from their motion, and verifies the earlier film."""
    began, anchor, found = (folder / "at.txt").read_text(), folder / "fleet.anchor", tmp_path / "found.key"
    code, out, err = decoded(folder / "now", "--anchor", anchor, *at(began), "--write-disclosed", found)
    assert (code, err) == (0, "")
    assert f"It carries the disclosed key of {DAY}: the anchor confirms it" in " ".join(out.split())
    assert "everybody who has the anchor can read it" in " ".join(out.split())
    given, read = (load_disclosed(path, load_anchor(anchor)) for path in (folder / "given.key", found))
    assert read.secret.link == given.secret.link
    assert found.stat().st_mode & 0o777 == 0o644

    then = json.loads((folder / "then" / "truth.json").read_text())["unix_s"]
    stated = at(datetime.fromtimestamp(then, UTC).isoformat())
    code, out, _ = decoded(folder / "then", "--anchor", anchor, "--disclosed", found, *stated, "--json")
    report = json.loads(out)
    assert (code, report["message"]) == (0, 1234)
    assert re.search("rests on --at alone", " ".join(report["rests_on"]))


@pytest.mark.slow
def test_the_film_of_the_day_itself_shows_nothing_publicly(decoded, folder, tmp_path):
    then = json.loads((folder / "then" / "truth.json").read_text())["unix_s"]
    stated = at(datetime.fromtimestamp(then, UTC).isoformat())
    found = tmp_path / "found.key"
    code, out, _ = decoded(folder / "then", "--anchor", folder / "fleet.anchor", *stated, "--write-disclosed", found)
    assert code == 3
    assert "It carries" not in out
    assert not found.exists()


@pytest.mark.slow
def test_another_anchor_reads_nothing(decoded, folder, tmp_path):
    """Another anchor is another public channel, on which nothing was said."""
    text = (folder / "fleet.anchor").read_text()
    other = tmp_path / "other.anchor"
    value = re.search(r'anchor = "(\w+)"', text)[1]
    other.write_text(text.replace(value, f"{int(value, 16) ^ 1:064x}"))
    found = tmp_path / "found.key"
    began = (folder / "at.txt").read_text()
    assert decoded(folder / "now", "--anchor", other, *at(began), "--write-disclosed", found)[0] == 3
    assert not found.exists()


def test_what_would_be_lost_is_found_before_the_work(decoded, folder, tmp_path):
    began, anchor = (folder / "at.txt").read_text(), folder / "fleet.anchor"
    taken = tmp_path / "taken.key"
    taken.write_text("")
    code, _, err = decoded(folder / "now", "--anchor", anchor, *at(began), "--write-disclosed", taken)
    assert (code, "exists already" in err) == (1, True)
    films = [tmp_path / name for name in ("one.mp4", "two.mp4")]
    for film in films:
        film.write_bytes(b"no film")
    code, _, err = decoded(*films, "--anchor", anchor, "--write-disclosed", tmp_path / "a.key")
    assert (code, "--write-disclosed is of one recording" in err) == (1, True)


def test_a_made_up_key_on_the_public_channel_is_named_as_such(folder):
    anchor = load_anchor(folder / "fleet.anchor")
    opened, slot = OpenedKey(public_key(anchor), None, anchor), slot_at(NOW.timestamp(), public_key(anchor).scheme)
    said = SimpleNamespace(
        verdict="decoded", message=b"made up, as anybody may do it here"[:32], scheme=public_key(anchor).scheme,
        frames=(SimpleNamespace(slots=(slot, slot)),),
    )  # fmt: skip
    with pytest.raises(StageError, match=r"is no key of the anchor's chain: everybody can play there"):
        opened.carried(said)
    said.message = load_disclosed(folder / "given.key", anchor).secret.link
    assert opened.carried(said).holding.grant.first_day == DAY
    said.verdict = "inconclusive"
    assert opened.carried(said) is None


@pytest.mark.parametrize("more", [("--key", "a.key"), ("--disclosed", "a.key")])
def test_only_an_anchor_alone_reads_the_public_channel(decoded, folder, more):
    anchor = () if "--key" in more else ("--anchor", folder / "fleet.anchor")
    code, _, err = decoded(folder / "now", *anchor, *more, "--write-disclosed", "b.key")
    assert code == 2
    assert "give" in err


@pytest.mark.parametrize(
    "options",
    [("--anchor", "a"), ("--disclosed", "d"), ("--anchor", "a", "--disclosed", "d", "--message", "1"),
     ("--anchor", "a", "--disclosed", "d", "--realtime")],
)  # fmt: skip
def test_recording_a_carried_key_takes_nothing_beside(options, tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        main(["record", "--out", str(tmp_path / "rec"), *options])
    assert left.value.code == 2
    assert "--anchor and --disclosed together" in " ".join(capsys.readouterr().err.replace("│", " ").split())
