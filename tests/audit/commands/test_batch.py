"""`mtm-audit batch` from the command line: the table, bad files, runs that were stopped, and clusters."""

import csv
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from mtm_audit.batch import run
from mtm_audit.batch.lost import Lost
from mtm_audit.batch.row import COLUMNS
from mtm_audit.cli import main
from tests.audit.batch.cluster_of_three import cluster_of
from tests.audit.batch.recordings import KEY, OTHER, record, save_keys
from tests.patience import until

GOOD, SENT = 7, (3, 1, 2, 0, 1, None, None)
BAD = ("empty.tum", "truncated.mp4", "text.mp4")


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """Ten recordings under two keys, three of them bad."""
    folder = tmp_path_factory.mktemp("lab")
    save_keys(folder)
    (folder / "films").mkdir()
    for number, symbol in enumerate(SENT):
        record(folder / "films" / f"{number}.tum", symbol, (KEY, OTHER)[number % 2], seed=number)
    (folder / "films" / "empty.tum").touch()
    (folder / "films" / "truncated.mp4").write_bytes(b"\0\0\0\x20ftypisom\0\0\2\0isomiso2avc1mp41\0\0")
    (folder / "films" / "text.mp4").write_text("not a film")
    return folder


@pytest.fixture
def batch(lab, tmp_path, monkeypatch, capsys):
    """Run the command in this process on all recordings; gives the exit code, standard output and standard error."""
    monkeypatch.chdir(lab)

    def run_command(*arguments, paths=None):
        with pytest.raises(SystemExit) as left:
            main(command(tmp_path / "results.csv", tmp_path / "cache", *arguments, paths=paths))
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code or 0, out, err

    return run_command


def command(out, cache, *arguments, paths=None):
    paths = sorted(map(str, Path("films").iterdir())) if paths is None else paths
    keys = ("--key", "fake.key", "--key", "other.key", "--onset", "1")
    return ["batch", *map(str, paths), *keys, "--out", str(out), "--cache", str(cache), *map(str, arguments)]


def started(lab, *arguments):
    """The command in a process of its own."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    program = [sys.executable, "-m", "mtm_audit", *command(*arguments, paths=sorted((lab / "films").iterdir()))]
    program = [word.replace(f"{lab}/", "") for word in program]
    return subprocess.Popen(
        program, cwd=lab, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def without_times(path):
    """The table's text, but for the column that says how long each recording took."""
    assert COLUMNS[-1] == "seconds"
    return [line.rpartition(",")[0] for line in path.read_text(encoding="utf-8").splitlines()]


@pytest.fixture(scope="module")
def table(lab, tmp_path_factory):
    """The table as one run makes it."""
    folder = tmp_path_factory.mktemp("table")
    process = started(lab, folder / "results.csv", folder / "cache", "--jobs", "2")
    out, err = process.communicate()
    assert process.returncode == 1, err
    assert "10 recordings: 5 decoded, 2 absent, 3 unreadable; the table is" in out
    assert "2 keys were tried on each, which costs 1.0 bits that are taken off" in out
    return folder / "results.csv"


def test_bad_files_are_named_and_all_others_are_read(lab, table):
    rows = {Path(row["path"]).name: row for row in rows_of(table)}
    assert list(rows) == sorted(path.name for path in (lab / "films").iterdir())
    assert {name for name, row in rows.items() if row["verdict"] == "unreadable"} == set(BAD)
    assert all(rows[name]["error"] for name in BAD)
    for number, symbol in enumerate(SENT):
        row = rows[f"{number}.tum"]
        assert (row["verdict"], row["message"]) == (("absent", "") if symbol is None else ("decoded", str(symbol)))
        assert row["key"] == ("" if symbol is None else ("fake.key", "other.key")[number % 2])


@pytest.mark.long
def test_good_files_say_the_same_without_the_bad_ones(batch, table, tmp_path):
    assert batch(paths=[f"films/{number}.tum" for number in range(GOOD)])[0] == 0
    good = [line for line in without_times(table) if not line.startswith(tuple(f"films/{name}" for name in BAD))]
    assert without_times(tmp_path / "results.csv") == good


@pytest.mark.parametrize("how", ["interrupted", pytest.param("killed", marks=pytest.mark.long)])
def test_a_run_that_was_stopped_goes_on(lab, batch, table, tmp_path, how):
    path = tmp_path / "results.csv"
    process = started(lab, path, tmp_path / "cache", "--jobs", "1")
    until(lambda: path.exists() and len(path.read_bytes().splitlines()) >= 3)
    if how == "killed":
        process.kill()
        process.communicate()
    else:
        process.send_signal(signal.SIGINT)
        out, err = process.communicate()
        assert process.returncode == 130
        assert err.endswith("results.csv, and the same command goes on from there\n")
        assert (out, "Traceback" in err) == ("", False)
    before = {row["path"]: row for row in rows_of(path) if row["verdict"] != "unreadable"}
    with path.open("a") as file:
        file.write("films/6.tum,half")
    code, out, _ = batch("--jobs", "2")
    assert code == 1
    assert f"{len(before)} of them were read before" in out or not before
    assert without_times(path) == without_times(table)
    after = {row["path"]: row for row in rows_of(path)}
    assert {name: after[name]["seconds"] for name in before} == {name: row["seconds"] for name, row in before.items()}


def test_a_file_that_holds_something_else_now_is_read_again(batch, tmp_path):
    path = record(tmp_path / "new.tum", None)
    assert "1 absent" in batch(paths=[path])[1]
    record(path, 2)
    code, out, _ = batch(paths=[path])
    assert (code, "1 decoded" in out, "read before" in out) == (0, True, False)
    assert "1 of them were read before and have not changed" in batch(paths=[path])[1]
    # Rows that answer another question are let go by force alone.
    before = (tmp_path / "results.csv").read_bytes()
    code, _, err = batch("--threshold", "0.001", paths=[path])
    assert (code, (tmp_path / "results.csv").read_bytes()) == (1, before)
    assert "made with other keys, options or another version" in err
    assert "read before" not in batch("--threshold", "0.001", "--force", paths=[path])[1]


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (("--jobs", "2", "--scheduler", "tcp://127.0.0.1:9"), 2, "the cluster's workers decide that"),
        (("--speed", "2", "--search-speed"), 2, "leave it or --search-speed out"),
        (("--jobs", "0"), 2, "--jobs"),
        (("--onset", "soon"), 2, "--onset"),
        (("--tracker", "sonar"), 1, "there is no tracker 'sonar'"),
        (("--detector", "ear"), 1, "ear"),
        (("--key", "films/0.tum"), 1, "films/0.tum"),
        (("--key", "fake.key"), 1, "hold the same key"),
        (("--cache", "fake.key/x"), 1, "name another folder with --cache"),
    ],
)
def test_what_cannot_be_done_is_said_before_anything_is(batch, tmp_path, arguments, code, sentence):
    found, out, err = batch(*arguments)
    assert (found, out) == (code, "")
    assert sentence in err
    assert not (tmp_path / "results.csv").exists()


def test_no_other_file_is_replaced(batch, lab, tmp_path):
    (tmp_path / "thesis.csv").write_text("mine")
    for path in (tmp_path / "thesis.csv", lab / "fake.key", lab / "films" / "0.tum"):
        before = path.read_bytes()
        code, _, err = batch("--out", path)
        assert (code, path.read_bytes()) == (1, before)
        assert "choose another name" in err


def test_a_recording_whose_processes_died_is_named(batch, tmp_path, monkeypatch):
    monkeypatch.setattr(
        run, "in_processes", lambda function, work, jobs: ((place, Lost()) for place in range(len(work)))
    )
    code, out, _ = batch(paths=["films/0.tum"])
    (row,) = rows_of(tmp_path / "results.csv")
    assert (code, "1 unreadable" in out, row["path"]) == (1, True, "films/0.tum")
    assert "ended from outside or crashed" in row["error"]


def test_without_dask_the_local_way_works(batch, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "distributed", None)
    path = record(tmp_path / "new.tum", None)
    code, _, err = batch("--scheduler", "tcp://127.0.0.1:9", paths=[path])
    assert (code, "messages-through-motion[cluster]" in err) == (1, True)
    assert batch(paths=[path])[0] == 0


@pytest.mark.long
def test_a_cluster_that_loses_a_worker_makes_the_same_table(lab, table, tmp_path):
    with cluster_of(tmp_path) as cluster:
        path = tmp_path / "results.csv"
        process = started(lab, path, tmp_path / "cache", "--scheduler", cluster.address)
        until(lambda: path.exists() and len(path.read_bytes().splitlines()) >= 3)
        cluster.workers[0].kill()
        out, err = process.communicate()
    assert (process.returncode, "10 recordings: 5 decoded" in out) == (1, True), err
    assert without_times(path) == without_times(table)
