import pytest

from hil.cli import main
from hil.experiments.runs.fingerprint import code_fingerprint


def run(*arguments):
    with pytest.raises(SystemExit) as ending:
        main([str(argument) for argument in arguments])
    return ending.value.code


def quick(tmp_path, arm, count=1):
    return ["verdicts", arm, "-n", count, "--seed", 5, "--workers", 1, "--out", tmp_path / "a.csv",
            "--cells", tmp_path / "cells.jsonl"]  # fmt: skip


def test_validity_writes_a_row_for_each_level_and_one_kind_alone(tmp_path, capsys):
    assert run(*quick(tmp_path, "validity"), "--only", "sine") == 0
    first, second, _, *rows = (tmp_path / "a.csv").read_text().splitlines()
    assert first == f'# mtm-hil verdicts validity -n 1 --recordings 2 --only "sine" --seed 5 --out {tmp_path}/a.csv'
    assert second == f"# code {code_fingerprint()}"
    assert [row.split(",")[0] for row in rows] == ["sine"] * 3 + ["all"] * 3
    assert "2 keys on 2 recordings" in capsys.readouterr().out
    assert len((tmp_path / "cells.jsonl").read_text().splitlines()) == 2


def test_sure_goes_on_from_the_cells_that_are_finished(tmp_path, capsys, monkeypatch):
    assert run(*quick(tmp_path, "sure"), "--only", "tanh") == 0
    table = (tmp_path / "a.csv").read_text()
    assert table.count("tanh,") == 3
    monkeypatch.setattr("hil.commands.verdicts.decode_sent", None)
    assert run(*quick(tmp_path, "sure"), "--only", "tanh") == 0
    assert (tmp_path / "a.csv").read_text() == table


def test_a_name_that_is_not_known_gets_one_sentence(tmp_path, capfd):
    assert run(*quick(tmp_path, "sure"), "--only", "hovercraft") == 2
    error = capfd.readouterr().err
    assert "there is no 'hovercraft' to measure; choose from: robomaster; " in error
    assert error.count("\n") == 1
    assert not (tmp_path / "a.csv").exists()


def test_power_prints_the_smallest_message_that_is_decoded(tmp_path, capsys, monkeypatch):
    at = {f"{what} {threshold}": value for threshold in ("0.1", "0.01", "0.0001")
          for what, value in (("verdict", "decoded"), ("right", True))}  # fmt: skip
    monkeypatch.setattr("hil.commands.verdicts.decode_job", lambda *_: {**at, "likeliest_right": True})
    assert run(*quick(tmp_path, "power", 2)) == 0
    assert "once, onset unknown: smallest T from which on most rollouts are decoded at 0.1, 0.01, 0.0001: 100" in (
        capsys.readouterr().out
    )
    assert (tmp_path / "a.csv").read_text().count("\n") == 4 + 1 + 3 * 12


def test_watched_counts_the_verdicts_on_silent_streams(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("hil.experiments.verdicts.watched.SECONDS", 3.0)
    assert run(*quick(tmp_path, "watched")) == 0
    _, _, head, row = (tmp_path / "a.csv").read_text().splitlines()
    counts = dict(zip(head.split(","), row.split(","), strict=True))
    assert (counts["streams"], counts["decoded"]) == ("4", "0")
    assert int(counts["looks"]) > int(counts["weighed"]) >= 4
    assert "4 silent streams" in capsys.readouterr().out


def test_a_watch_of_the_experiment_would_find_a_message():
    from hil.experiments.verdicts.watched import Tally, watch_track
    from tests.audit.moving_robot import key_of, robot_track, scheme_of

    key, tally = key_of(scheme_of(symbols=(1,), ticks=200)), Tally()
    watch = watch_track(robot_track(key, "robot0", (2,), 8.0, onset_s=1.0, rate_hz=25.0), key, 60.0, tally)
    assert watch.best.decoding.message == 2
    assert tally.verdicts == {"decoded": 1}
