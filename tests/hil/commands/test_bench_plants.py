import pytest

from hil.cli import main
from hil.commands.bench_plants import summarise_plant
from hil.experiments.plants.rollout import PlantJob
from hil.experiments.runs.fingerprint import code_fingerprint


def run(*arguments):
    with pytest.raises(SystemExit) as ending:
        main([str(argument) for argument in arguments])
    return ending.value.code


def asked(tmp_path, plants):
    return ["bench", "--plants", plants, "--rollouts", 1, "--ticks", 60, "--out", tmp_path / "a.csv", "--cells",
            tmp_path / "cells.jsonl"]  # fmt: skip


def test_a_row_for_each_plant_that_was_named(tmp_path, capsys):
    assert run(*asked(tmp_path, "spinning,notch")) == 0
    first, second, header, *rows = (tmp_path / "a.csv").read_text().splitlines()
    assert first == f"# mtm-hil bench --plants spinning,notch --ticks 60 --rollouts 1 --out {tmp_path}/a.csv"
    assert second == f"# code {code_fingerprint()}"
    assert [row.split(",")[:3] for row in rows] == [["spinning", "vx vy", "16"], ["notch", "vx vy", "16"]]
    assert header.split(",")[8:11] == ["coherency", "coherency_low", "coherency_high"]
    assert "symbols right in %" in capsys.readouterr().out


def test_a_plant_that_is_not_known_gets_one_sentence(tmp_path, capfd):
    assert run(*asked(tmp_path, "arm,boat")) == 2
    error = capfd.readouterr().err
    assert "there is no plant 'boat'" in error
    assert error.count("\n") == 1


def test_a_quick_look_is_for_the_usual_robot_alone(tmp_path, capfd):
    assert run(*asked(tmp_path, "arm"), "--quick") == 2
    assert "--quick and --plot do not go with --plants" in capfd.readouterr().err.replace("\n", " ")


def test_rollouts_are_counted_by_symbol_and_by_verdict():
    one = {"genie": 4, "matched": 3, "coherency": 1, "verdict": "decoded", "wrong": True, "bits": 20.0}
    other = {**one, "verdict": "absent", "wrong": False, "bits": 4.0}
    row = summarise_plant("arm", PlantJob(), [one, other])
    assert {name: (share.successes, share.trials) for name, share in row.symbols.items()} == {
        "coherency": (2, 8), "matched": (6, 8), "genie": (8, 8),
    }  # fmt: skip
    assert row.verdicts == {"decoded": 1, "inconclusive": 0, "absent": 1, "refused": 0}
    assert (row.wrong, row.bits) == (1, 12.0)
