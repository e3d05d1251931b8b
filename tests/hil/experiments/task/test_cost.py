import csv
from io import StringIO

import pytest
from rich.console import Console

from hil.cli import main
from hil.experiments.runs.cells import CellStore
from hil.experiments.task import cost
from hil.experiments.task.drive import Drive
from hil.experiments.task.noise import KEYED, WHITE
from hil.worlds.robomaster import fleet_scheme
from mtm_onboard.protocol import generate_key, save_key


def pretended(scheme, condition, seed):
    extra = {WHITE: 1.0, KEYED: 1.5}.get(condition, 0.0) + 0.01 * (seed % 3 if condition == KEYED else 0)
    return Drive(30.0 + extra, 0.05, 1.0, 0.2, 10.0)


@pytest.fixture
def costs(tmp_path, monkeypatch):
    monkeypatch.setattr(cost, "drive", pretended)
    with CellStore(tmp_path / "cells.jsonl") as store:
        return cost.measure_costs({"paper": fleet_scheme()}, 12, 0, store, Console(file=StringIO()), 1)


def test_keyed_noise_is_compared_drive_by_drive(costs):
    time, path, *_ = costs
    assert (time.measure, time.drives) == ("time_s", 12)
    assert time.means == pytest.approx({"clean": 30.0, "white": 31.0, "keyed": 31.51})
    assert (time.more, time.low) == (pytest.approx(0.51), pytest.approx(0.5046, abs=1e-4))
    assert 0.0 < time.low < time.high
    assert path.low <= 0.0 <= path.high


def test_a_table_is_printed_and_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cost, "drive", pretended)
    save_key(generate_key("paper", fleet_scheme()), tmp_path / "paper.key")
    with pytest.raises(SystemExit) as left:
        main(["cost", "paper.key", "-n", "2", "--workers", "1", "--out", "cost.csv", "--cells", "cells.jsonl"])
    assert (left.value.code or 0) == 0
    with open("cost.csv", encoding="utf-8") as file:
        lines = file.readlines()
    assert lines[0] == "# mtm-hil cost paper.key -n 2 --seed 60000 --out cost.csv\n"
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert [row["measure"] for row in rows] == list(cost.MEASURES)
    assert (rows[0]["clean"], rows[0]["white"]) == ("30", "31")


def test_two_keys_of_one_name_are_refused(tmp_path, capsys):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        save_key(generate_key("paper", fleet_scheme()), tmp_path / folder / "paper.key")
    with pytest.raises(SystemExit) as left:
        main(["cost", str(tmp_path / "a/paper.key"), str(tmp_path / "b/paper.key"), "-n", "2"])
    assert left.value.code == 1
    assert "two of the keys have one name" in capsys.readouterr().err
