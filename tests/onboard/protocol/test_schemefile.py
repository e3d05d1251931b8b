import pytest

from mtm_onboard.cli import main
from mtm_onboard.protocol import MtmError, load_key
from mtm_onboard.protocol.schemefile import load_scheme, save_scheme
from tests.onboard.schemes import small_scheme

SCHEME = small_scheme(combine="split", pooling="majority", power="ensemble", schedule="rolling", epoch=3)


@pytest.fixture
def written(tmp_path):
    path = tmp_path / "plan.toml"
    save_scheme(SCHEME, path, ("why it looks so",))
    return path


def test_a_scheme_file_returns_what_was_saved(written):
    assert load_scheme(written) == SCHEME
    assert written.read_text().startswith("# why it looks so\n[scheme]\n")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[scheme", "is not a scheme file"),
        ("scheme = 3", "must hold one table"),
        ("", "must hold one table"),
        ('secret = "ab"\n[scheme]\n', "must hold one table"),
        ("[scheme]\nversion = 1", "plan.toml: the scheme lacks"),
    ],
)
def test_what_is_no_scheme_file_is_refused_in_one_sentence(written, text, says):
    written.write_text(text)
    with pytest.raises(MtmError, match=says):
        load_scheme(written)


def test_a_missing_or_binary_scheme_file_is_refused(written):
    with pytest.raises(MtmError, match="check the name"):
        load_scheme(written.parent / "none.toml")
    written.write_bytes(b"\xff\x00")
    with pytest.raises(MtmError, match="is not a scheme file"):
        load_scheme(written)


def test_keygen_provisions_the_scheme_of_a_file(written, tmp_path):
    assert main(["keygen", "--id", "fake-key", "--scheme", str(written), "--out", str(tmp_path / "robot.key")]) == 0
    assert load_key(tmp_path / "robot.key").scheme == SCHEME


def test_keygen_takes_a_scheme_file_or_options_and_not_both(written, tmp_path, capsys):
    for option in (["--alphabet", "8"], ["--preset", "paper-robomaster-fleet"]):
        with pytest.raises(SystemExit) as left:
            main(["keygen", "--id", "a", "--scheme", str(written), "--out", str(tmp_path / "robot.key"), *option])
        assert left.value.code == 2
    assert "--scheme gives the whole scheme" in capsys.readouterr().err
    assert not (tmp_path / "robot.key").exists()
