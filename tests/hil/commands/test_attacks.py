import pytest
from rich.console import Console

from hil.cli import main
from hil.commands.attacks import AttackOptions, attacks
from hil.experiments.attacks.registry import ATTACKS


def options(tmp_path, count=1):
    return AttackOptions(names=("relay",), rollouts=count, first_seed=5, workers=1, out=tmp_path,
                         plot=tmp_path / "a.png", force=False, cells=tmp_path / "cells.jsonl")  # fmt: skip


def test_it_goes_on_from_the_cells_that_are_finished(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("hil.commands.attacks.make_world", lambda name: None)
    answer = {"matched trials": 4, "matched right": 3}
    monkeypatch.setattr("hil.experiments.attacks.measured.measure_attack", lambda parameters, seed: answer)
    attacks(options(tmp_path), Console())
    table = (tmp_path / "attacks_relay.csv").read_text()
    assert table.startswith("# mtm-hil attacks --only relay -n 1 --seed 5 --out ")
    assert table.count("\n") == 4 + len(ATTACKS["relay"].levels["--at-error 2"])
    assert "75.0" in capsys.readouterr().out
    monkeypatch.setattr("hil.experiments.attacks.measured.measure_attack", None)
    attacks(options(tmp_path), Console())
    assert (tmp_path / "attacks_relay.csv").read_text() == table
    assert (tmp_path / "a.png").exists()


def test_an_attack_that_is_not_known_gets_one_sentence(tmp_path, capfd):
    with pytest.raises(SystemExit) as ending:
        main(["attacks", "--only", "bribery", "--cells", str(tmp_path / "cells.jsonl")])
    assert ending.value.code == 1
    error = capfd.readouterr().err
    assert "there is no attack 'bribery'; choose from: additive_noise, " in error
    assert error.count("\n") == 1
