import pytest

from hil.commands.new_folder import new_folder
from mtm_onboard.protocol import MtmError


def test_the_folder_appears_when_everything_is_in_it(tmp_path):
    with new_folder(tmp_path / "above" / "a") as folder:
        (folder / "file").write_text("x")
        assert not (tmp_path / "above" / "a").exists()
    assert [path.name for path in (tmp_path / "above").iterdir()] == ["a"]
    assert (tmp_path / "above" / "a" / "file").read_text() == "x"


@pytest.mark.parametrize("ending", [ValueError, KeyboardInterrupt, SystemExit])
def test_nothing_is_left_of_one_that_failed(tmp_path, ending):
    def fail():
        with new_folder(tmp_path / "a") as folder:
            (folder / "file").write_text("x")
            raise ending

    with pytest.raises(ending):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_what_exists_is_never_touched(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(MtmError, match="exists already"), new_folder(tmp_path / "a"):
        pass
    (tmp_path / "file").write_text("kept")
    with pytest.raises(MtmError, match="cannot make"), new_folder(tmp_path / "file" / "a"):
        pass
    assert (tmp_path / "file").read_text() == "kept"


def test_a_folder_that_appears_meanwhile_is_left_alone(tmp_path):
    def make():
        with new_folder(tmp_path / "a"):
            (tmp_path / "a").mkdir()
            (tmp_path / "a" / "file").write_text("kept")

    with pytest.raises(MtmError, match="meanwhile"):
        make()
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a" / "file").read_text() == "kept"
