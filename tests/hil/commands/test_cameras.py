from io import StringIO

from rich.console import Console

from hil.commands import cameras
from hil.experiments.cameras.filmed import CONDITIONS
from hil.experiments.cameras.tilted import VIEWS


def pretended(parameters, seed):
    return {"bits": 200.0 - float(parameters["shake_px"]), "right": True, "seen": 1.0}


def test_the_table_is_printed_and_written(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(cameras, "film_and_decode", pretended)
    out = tmp_path / "cameras.csv"
    cameras.cameras(1, 5, 1, out, tmp_path / "cells.jsonl", Console(file=StringIO()))
    printed = capsys.readouterr().out
    assert "shake, floor carpet, 10 px, pan 0, roll 0 degrees: 190 bits, 95 %, 1 of 1 messages right" in printed
    assert "markers at 45 degrees: 200 bits, 100 %, 1 of 1 messages right" in printed
    lines = out.read_text().splitlines()
    assert lines[0] == f"# mtm-hil cameras -n 1 --seed 5 --out {out}"
    assert lines[1].startswith("# code ")
    assert len(lines) == 3 + len(CONDITIONS)


def test_views_from_the_side_have_a_table_of_their_own(tmp_path, monkeypatch, capsys):
    nats = {"plain": 120.0, "straightened": 118.0, "above": 150.0, "both": 160.0}
    monkeypatch.setattr(cameras, "film_and_read", lambda parameters, seed: {way: nats[way] + seed for way in nats})
    out = tmp_path / "camera_tilts.csv"
    cameras.tilts(2, 5, 1, out, tmp_path / "cells.jsonl", Console(file=StringIO()))
    printed = capsys.readouterr().out
    assert "wide lens, 65 degrees from straight down: plain 126, straightened 124, above 156, both 166 nats" in printed
    lines = out.read_text().splitlines()
    assert lines[0] == f"# mtm-hil cameras --tilts -n 2 --seed 5 --out {out}"
    assert lines[2] == "lens,tilt_deg,rollouts,plain,straightened,above,both"
    assert lines[3] == "wide,0.0,2,125.5,123.5,155.5,165.5"
    assert len(lines) == 3 + len(VIEWS)
