import csv
from dataclasses import asdict

import pytest
from rich.console import Console

from hil.cli import main
from hil.experiments.plants import quiet
from hil.experiments.plants.quiet import JOBS, QuietJob, quiet_rows, read_quiet
from hil.experiments.runs.cells import CellStore

LOUD = QuietJob(8, 400, 1, 0.05)
RESULTS = ({"verdict": "decoded", "right": True, "symbols": 2, "bits": 20.0},
           {"verdict": "decoded", "right": False, "symbols": 1, "bits": 15.0},
           {"verdict": "absent", "right": False, "symbols": 2, "bits": -1.0})  # fmt: skip


def pretended(parameters, seed):
    result = RESULTS[seed % 3]
    return {**result, "symbols": min(int(result["symbols"]), int(parameters["symbols"]))}


def test_both_axes_say_the_same_in_the_stated_time():
    assert {(job.bits, job.seconds) for job in JOBS} == {(3.0, 48.0), (48.0, 48.0)}
    scheme = QuietJob(8, 2400, 1, 0.01).scheme
    assert [(channel.axes, channel.sigmas) for channel in scheme.channels] == [(("vx",), (0.01,)), (("wz",), (0.05,))]
    assert {channel.body for channel in scheme.channels} == {"robot0"}
    assert (scheme.combine, scheme.framing, scheme.message_symbols) == ("same", None, 1)


def test_a_loud_message_is_received_and_none_of_no_noise():
    loud = read_quiet(asdict(LOUD), 5)
    assert (loud["verdict"], loud["right"], loud["symbols"]) == ("decoded", True, 1)
    assert loud == read_quiet(asdict(LOUD), 5)
    assert read_quiet(asdict(QuietJob(8, 400, 1, 1e-6)), 5)["verdict"] == "absent"


def test_only_what_is_decoded_and_right_is_received(tmp_path, monkeypatch):
    monkeypatch.setattr(quiet, "read_quiet", pretended)
    with CellStore(tmp_path / "cells.jsonl") as store:
        row, short = quiet_rows([QuietJob(8, 400, 2, 0.05), LOUD], 3, store, Console(), seed=0, workers=1)
    assert (row.received.successes, row.received.trials, row.wrong) == (1, 3, 1)
    assert (row.symbols.successes, row.symbols.trials) == (5, 6)
    assert row.median_bits == 15.0
    assert (short.symbols.successes, short.symbols.trials) == (3, 3)


def test_a_table_of_all_jobs_is_printed_and_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(quiet, "read_quiet", pretended)
    with pytest.raises(SystemExit) as left:
        main(["quiet", "-n", "3", "--seed", "0", "--workers", "1", "--out", "quiet.csv", "--cells", "cells.jsonl"])
    assert (left.value.code or 0) == 0
    lines = (tmp_path / "quiet.csv").read_text().splitlines()
    assert lines[0] == "# mtm-hil quiet -n 3 --seed 0 --out quiet.csv"
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert len(rows) == len(JOBS)
    assert (rows[0]["received"], rows[0]["wrong"], rows[0]["median_bits"]) == ("33.33", "1", "15.0")
    assert float(rows[0]["sigma_radps"]) == pytest.approx(5.0 * float(rows[0]["sigma_mps"]))
    assert "received" in capsys.readouterr().out
