import hashlib
import subprocess

import pytest

from mtm_audit.batch.content import content_of
from mtm_onboard.protocol import MtmError


def test_the_hash_of_one_file_is_that_of_what_it_holds(tmp_path):
    (tmp_path / "a").write_bytes(b"film")
    assert content_of([tmp_path / "a"]).sha256 == hashlib.sha256(b"film").hexdigest()


def test_the_hash_of_several_is_that_of_what_sha256sum_prints(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).write_text(name)
    listed = subprocess.run(["sha256sum", "a", "b"], cwd=tmp_path, capture_output=True, check=True).stdout
    assert content_of([tmp_path / "a", tmp_path / "b"]).sha256 == hashlib.sha256(listed).hexdigest()
    assert content_of([tmp_path]).sha256 == hashlib.sha256(listed).hexdigest()


@pytest.mark.parametrize("change", ["rename", "write", "add"])
def test_any_change_in_a_folder_changes_its_hash(tmp_path, change):
    folder = tmp_path / "bag"
    folder.mkdir()
    (folder / "a").write_text("a")
    (folder / "b").write_text("b")
    before = content_of([folder]).sha256
    if change == "rename":
        (folder / "a").rename(folder / "c")
    else:
        (folder / ("a" if change == "write" else "new")).write_text("new")
    assert content_of([folder]).sha256 != before


def test_a_file_that_is_gone_gets_one_sentence(tmp_path):
    with pytest.raises(MtmError, match="cannot read .*gone: No such file or directory; "):
        content_of([tmp_path / "gone"])
