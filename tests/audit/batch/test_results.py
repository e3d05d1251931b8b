import fcntl
from pathlib import Path

import pytest

from mtm_audit.batch.results import ResultsFile, check_results
from mtm_audit.batch.row import Row, header, lines_of
from mtm_onboard.protocol import MtmError, load_key
from tests.audit.batch.recordings import save_keys

RUN = "0123456789abcdef"


def row(name, verdict="absent", **changes):
    return Row(**{"path": name, "verdict": verdict, "keys_tried": "1", "run": RUN} | changes)


def opened(path, names="abc", run=RUN, force=False):
    return ResultsFile(path, run, names, force=force)


@pytest.fixture
def path(tmp_path):
    """A table with a row of a, and two of b."""
    path = tmp_path / "results.csv"
    with opened(path) as results:
        results.add("b", (row("b", key="1"), row("b", key="2")))
        results.add("a", (row("a"),))
    return path


def test_rows_are_on_disk_at_once_and_in_order_in_the_end(path):
    assert path.read_text() == header() + lines_of([row("b", key="1"), row("b", key="2")]) + lines_of([row("a")])
    with opened(path) as results:
        results.add("c", (row("c"),))
        assert [rows[0].path for rows in results.finish("abc")] == list("abc")
    assert [line[0] for line in path.read_text().splitlines()[1:]] == list("abbc")


@pytest.mark.parametrize("cut", range(1, 120))
def test_a_half_line_loses_its_recording_and_no_other(tmp_path, path, cut):
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut])
    lines = whole.decode().splitlines(keepends=True)
    ends = [len(header()) + sum(len(line) for line in lines[1:number]) for number in (3, 4)]
    expected = {name for name, end in zip("ba", ends, strict=True) if len(whole) - cut >= end}
    with opened(path) as results:
        assert results.kept.keys() == expected
    assert path.read_text() == header() + "".join(lines[1 : 1 + {0: 0, 1: 2, 2: 3}[len(expected)]])


def test_the_second_row_of_a_recording_is_not_kept_alone(path):
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([lines[0], *lines[2:]]))
    with opened(path) as results:
        assert results.kept.keys() == {"a"}


def test_the_newest_rows_of_a_recording_count(path):
    with opened(path) as results:
        results.add("a", (row("a", "decoded"),))
    with opened(path) as results:
        assert results.kept["a"][0].verdict == "decoded"


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"names": "ac"}, "rows of recordings that are not named now, such as b; name them too"),
        ({"run": "f" * 16}, "made with other keys, options or another version; choose another file"),
    ],
)
def test_no_row_is_let_go_without_being_told_to(path, changes, sentence):
    before = path.read_bytes()
    with pytest.raises(MtmError, match=sentence):
        opened(path, **changes)
    assert path.read_bytes() == before
    with opened(path, **changes, force=True) as results:
        assert results.kept.keys() == ({"a"} if "names" in changes else set())


def test_two_programs_do_not_write_one_table(path):
    with opened(path), pytest.raises(MtmError, match="another program is writing"):
        opened(path)
    with path.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@pytest.mark.parametrize("force", [False, True])
def test_a_file_of_another_kind_is_replaced_by_force_alone(tmp_path, force):
    path = tmp_path / "thesis.csv"
    path.write_text("path,verdict\nmine,absent\n")
    if force:
        check_results(path, force=True)
        with opened(path, force=True):
            assert path.read_text() == header()
        return
    with pytest.raises(MtmError, match="was not made by mtm-audit batch; choose another name, or"):
        check_results(path, force=False)
    assert path.read_text() == "path,verdict\nmine,absent\n"


def test_a_key_file_is_never_replaced(tmp_path):
    path: Path = save_keys(tmp_path)[0]
    for check in (check_results, lambda path, force: opened(path, force=force)):
        with pytest.raises(MtmError, match="is a key file, and no command replaces one"):
            check(path, force=True)
    assert load_key(path).id == "fake"
