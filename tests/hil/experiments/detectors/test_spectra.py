import csv

import numpy as np
import pytest
from rich.console import Console

from hil.commands.bench_spectra import SpectraOptions, bench_spectra
from hil.experiments.detectors import spectra
from hil.experiments.detectors.spectra import BANDS_HZ, FILLED, USUAL, WIDE, ShapedJob, filled_points
from hil.plants.mecanum import calibrated_parameters
from mtm_onboard.protocol.spectrum import check_points

PLANT = calibrated_parameters()


@pytest.fixture(autouse=True)
def _few_silences(monkeypatch):
    monkeypatch.setattr(spectra, "_SILENCES", 1)
    monkeypatch.setattr(spectra, "_SILENT_S", 8.0)
    spectra._ratios.cache_clear()
    yield
    spectra._ratios.cache_clear()


def test_each_shape_is_a_scheme_of_the_same_noise():
    jobs = {shape: ShapedJob(16, 50, 2, 0.1, shape) for shape in BANDS_HZ}
    assert [jobs[shape].scheme.band_hz for shape in (USUAL, WIDE, FILLED)] == [(0.5, 5.0), (0.3, 8.0), (0.3, 8.0)]
    assert jobs[USUAL].scheme.spectrum is None is jobs[WIDE].scheme.spectrum
    assert jobs[FILLED].scheme.spectrum == filled_points(PLANT)
    assert {channel.sigma for job in jobs.values() for channel in job.scheme.channels} == {0.1}


def test_the_filled_spectrum_leaves_out_what_is_weak():
    points = filled_points(PLANT)
    check_points(points)
    assert (points[0][0], points[-1][0]) == (0.3, 8.0)
    # The plant's lag and the held ticks make high frequencies the weakest.
    assert points[-1][1] == min(level_db for _, level_db in points) < -3.0


def test_a_table_of_all_shapes_is_written(tmp_path, monkeypatch, capsys):
    for name, value in (("_ALPHABET_SIZE", 16), ("_WINDOW_TICKS", 60), ("_WINDOWS", 2)):
        monkeypatch.setattr(spectra, name, value)
    monkeypatch.setattr(
        spectra, "run_sweep", lambda read, cells, *rest: [read(own.parameters, own.seed) for own in cells]
    )
    bench_spectra(SpectraOptions(1, tmp_path / "spectra.csv", tmp_path / "cells.jsonl"), Console())
    lines = (tmp_path / "spectra.csv").read_text().splitlines()
    assert lines[0].startswith("# mtm-hil bench --spectra --rollouts 1 --out ")
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert [row["spectrum"] for row in rows] == [USUAL, WIDE, FILLED]
    assert all(int(row["symbols"]) == 8 for row in rows)
    assert np.mean([float(row["genie"]) for row in rows]) > 70.0
    assert float(rows[2]["capacity_bps"]) > float(rows[1]["capacity_bps"])
    assert "0.3-8 Hz, water-filled: capacity " in capsys.readouterr().out


def test_spectra_have_one_table_of_their_own(capsys):
    from hil.cli import main

    with pytest.raises(SystemExit) as ending:
        main(["bench", "--spectra", "--quick"])
    assert ending.value.code == 2
    assert "--spectra has one table of its own" in capsys.readouterr().err
