import csv

from rich.console import Console

from hil.commands.frames import frames
from hil.experiments.messages.frames import frame_cells
from hil.experiments.runs.cells import CellStore


def test_the_table_comes_from_the_cells_with_its_command_line(tmp_path, capsys):
    cells, out = tmp_path / "cells.jsonl", tmp_path / "frames.csv"
    with CellStore(cells) as store:
        for plan in frame_cells(200, 0):
            for cell in plan:
                store.add(cell, {"frames": 100, "right": 60, "wrong": 1, "tries": 65_536})
    frames(200, 0, 1, out, cells, Console())
    assert "of 100 frames 60 read right and 1 wrong, 1 expected of 65536 tries" in capsys.readouterr().out
    with out.open() as file:
        assert next(file).startswith("# mtm-hil frames -n 200 --seed 0 --out ")
        assert next(file).startswith("# code ")
        rows = list(csv.DictReader(file))
    assert len(rows) == 12 + 8 + 18
    assert (rows[0]["what"], rows[0]["check_bits"], rows[0]["wrong"]) == ("noise", "16", "1")
    assert 0.0 < float(rows[0]["wrong_low"]) < 0.01 < float(rows[0]["wrong_high"])
