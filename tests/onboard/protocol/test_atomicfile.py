import os
import threading
from contextlib import suppress

import pytest

from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.atomicfile import replacing, write_new


def test_a_file_appears_when_the_block_has_succeeded(tmp_path):
    path = tmp_path / "a.toml"
    with replacing(path) as temporary:
        temporary.write_text("new")
        assert not path.exists()
        assert (temporary.parent, temporary.suffix) == (path.parent, ".toml")
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("mode", [0o600, 0o644])
def test_a_file_has_the_asked_mode_before_anything_is_in_it(tmp_path, mode):
    with replacing(tmp_path / "a", mode=mode) as temporary:
        assert os.stat(temporary).st_mode & 0o777 == mode
    assert os.stat(tmp_path / "a").st_mode & 0o777 == mode


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_block_that_fails_leaves_the_file_as_it_was(tmp_path, error):
    path = tmp_path / "a"
    path.write_text("old")

    def fail(temporary):
        temporary.write_text("half")
        raise error

    with pytest.raises(error), replacing(path) as temporary:
        fail(temporary)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_does_not_exist_is_refused(tmp_path):
    with (
        pytest.raises(MtmError, match=r"cannot write .*: No such file or directory; choose a folder"),
        replacing(tmp_path / "none" / "a"),
    ):
        pass


def test_a_folder_is_not_replaced_by_a_file(tmp_path):
    (tmp_path / "a").mkdir()
    with pytest.raises(MtmError, match="Is a directory; name a file"), replacing(tmp_path / "a"):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_of_many_that_write_a_new_file_at_once_one_succeeds(tmp_path):
    path, start, done = tmp_path / "a", threading.Barrier(8), []

    def write(text):
        start.wait()
        with suppress(MtmError):
            write_new(path, text, mode=0o600)
            done.append(text)

    for _ in range(50):
        threads = [threading.Thread(target=write, args=(f"{number}",)) for number in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert [path.read_text()] == done
        assert os.stat(path).st_mode & 0o777 == 0o600
        assert list(tmp_path.iterdir()) == [path]
        path.unlink()
        done.clear()


def test_a_new_file_does_not_follow_a_link_to_nowhere(tmp_path):
    (tmp_path / "a").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(MtmError, match="exists already"):
        write_new(tmp_path / "a", "text", mode=0o600)
    assert not (tmp_path / "elsewhere").exists()
