import json

import pytest

from hil.cli import main
from hil.experiments.worlds.points import headline_point
from mtm_audit.cli import main as audit
from mtm_onboard.protocol import Key, generate_key, load_key, save_key
from tests.audit.moving_robot import scheme_of


def filmed(capsys, *arguments):
    """Run `mtm-hil film`; gives the exit code, standard output and standard error."""
    with pytest.raises(SystemExit) as leaving:
        main(["film", *map(str, arguments)])
    captured = capsys.readouterr()
    return leaving.value.code or 0, captured.out, captured.err


@pytest.mark.slow
def test_a_filmed_lander_is_decoded_with_the_named_tracker(tmp_path, capsys):
    key = Key("lander", b"not a real secret, only for test", headline_point("lunar-lander").scheme)
    save_key(key, tmp_path / "lander.key")
    out = tmp_path / "lander"
    arguments = ["--message", 6, "--seconds", 60, "--key", tmp_path / "lander.key"]
    code, said, _ = filmed(capsys, "lunar-lander", "--out", out, *arguments)
    assert code == 0
    assert not (out / "robot.key").exists()
    assert "decode it with --tracker brightness:0,0,600,200" in said
    with pytest.raises(SystemExit) as leaving:
        audit(["decode", str(out / "video.mp4"), "--key", str(tmp_path / "lander.key"), "--json",
               "--tracker", "brightness:0,0,600,200"])  # fmt: skip
    assert leaving.value.code in (0, None)
    decoded = json.loads(capsys.readouterr().out)
    assert (decoded["verdict"], decoded["message"]) == ("decoded", 6)
    assert json.loads((out / "truth.json").read_text())["message"] == 6


def test_without_a_key_the_film_brings_its_own(tmp_path, capsys):
    out = tmp_path / "arm"
    code, said, _ = filmed(capsys, "reacher", "--out", out, "--no-message", "--seconds", 2)
    assert code == 0
    assert "no message" in said
    assert load_key(out / "robot.key").scheme.name == "reacher"


def test_a_key_for_something_else_is_refused_and_leaves_nothing(tmp_path, capsys):
    save_key(generate_key("other", scheme_of()), tmp_path / "other.key")
    out = tmp_path / "arm"
    code, _, error = filmed(capsys, "reacher", "--out", out, "--no-message", "--key", tmp_path / "other.key")
    assert code == 1
    assert "reacher has no axis" in error
    assert not out.exists()


def test_a_film_needs_a_message_or_none(tmp_path, capsys):
    code, _, error = filmed(capsys, "reacher", "--out", tmp_path / "arm")
    assert code == 2
    assert "give either --message N or --no-message" in error
