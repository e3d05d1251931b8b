import csv

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.cli import main
from hil.experiments.detectors.bench import FIRST_SEED, Row, conditions
from hil.experiments.detectors.bench_recording import ONSET_S, Job, record
from hil.experiments.detectors.bench_rollout import COHERENCY, GENIE, MATCHED
from hil.experiments.detectors.bench_summary import crossing, isotonic, shortest_window, summary
from hil.experiments.detectors.capacity import capacity_bps
from hil.experiments.runs.proportion import Proportion
from hil.plants.mecanum import calibrated_parameters
from mtm_audit.detectors.matched.motion import Motion

PLANT = calibrated_parameters()


def run_bench(folder, name):
    files = ["--out", folder / f"{name}.csv", "--plot", folder / f"{name}.png", "--cells", folder / "cells.jsonl"]
    with pytest.raises(SystemExit) as ending:
        main(["bench", "--quick", *map(str, files)])
    assert ending.value.code == 0
    return folder / f"{name}.csv"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("bench")


@pytest.fixture(scope="module")
def written(folder):
    return run_bench(folder, "first").read_text().splitlines()


def rows_of(lines):
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def test_the_file_begins_with_the_command_and_three_detectors(written):
    assert written[0].startswith("# mtm-hil bench --quick --out ")
    rows = rows_of(written)
    assert len(rows) == 12
    assert [row["detector"] for row in rows[:3]] == ["coherency", "matched", "genie"]
    assert any("Shannon capacity" in line for line in written)


def test_matched_and_genie_read_what_the_paper_s_does_not(written):
    paper, matched, genie = (int(row["symbols_correct"]) for row in rows_of(written)[:3])
    assert genie == matched == 12 > paper


def test_a_second_run_takes_everything_from_the_cells(folder, written):
    before = (folder / "cells.jsonl").read_bytes()
    again = run_bench(folder, "again").read_text().splitlines()
    assert again[1:] == written[1:]
    assert (folder / "cells.jsonl").read_bytes() == before
    assert (folder / "again.png").read_bytes()[:4] == b"\x89PNG"


def test_an_undrawable_picture_is_refused_before_the_work(tmp_path, capsys):
    with pytest.raises(SystemExit) as ending:
        main(["bench", "--plot", str(tmp_path / "a.doc"), "--cells", str(tmp_path / "cells.jsonl")])
    assert ending.value.code == 2
    assert "no picture format" in capsys.readouterr().err
    assert not (tmp_path / "cells.jsonl").exists()


def test_auditors_see_the_motion_until_the_message_ends():
    recording = record(Job(4, 100, 1, 0.1), PLANT, 1)
    assert recording.seen[0].edges_s[[0, -1]] == pytest.approx([0.0, ONSET_S + 2.0])
    assert recording.longer[0].edges_s[-1] >= ONSET_S + 2.5
    assert np.array_equal(
        recording.longer[0].velocities[: len(recording.seen[0].velocities)], recording.seen[0].velocities
    )


def test_a_rollout_of_one_window_sends_a_permutation():
    assert sorted(record(Job(4, 50, 1, 0.1), PLANT, 2).symbols[:, 0]) == [0, 1, 2, 3]
    assert record(Job(16, 50, 3, 0.1), PLANT, 2).symbols.shape == (4, 3)
    assert record(Job(16, 50, 3, 0.1), PLANT, 2).symbols.max() > 3


def test_no_condition_comes_twice_and_no_seed_was_developed_on():
    jobs = [condition.job for condition in conditions(200)]
    assert len(set(jobs)) == len(jobs)
    assert FIRST_SEED >= 10_000
    assert all(1 <= condition.rollouts <= 200 for condition in conditions(200))


def row(detector, ticks, messages, sigma=0.1):
    return Row(Job(4, ticks, 1, sigma), detector, 200, Proportion(800, 800), Proportion(messages, 200))


def test_the_shortest_window_is_the_first_of_99_percent_whole():
    rows = [row(MATCHED, 50, 150), row(MATCHED, 100, 198), row(MATCHED, 150, 200), row(COHERENCY, 400, 199)]
    assert shortest_window(rows, MATCHED, 99.0) == 100
    assert shortest_window(rows, GENIE, 99.0) is None
    lines = summary(rows)
    assert "paper's job: coherency takes 4.00 times the window of matched" in lines
    assert "paper's job, genie: no T measured has 99 % of the messages whole" in lines


def test_the_distance_to_the_genie_is_in_decibels_of_sigma():
    rows = [row(name, 150, 100, low) for name, low in ((MATCHED, 0.04), (GENIE, 0.02))]
    rows += [row(name, 150, 200, 2.0 * low) for name, low in ((MATCHED, 0.04), (GENIE, 0.02))]
    assert any("matched is 6.0 dB from the genie" in line for line in summary(rows))


def test_a_level_is_crossed_between_the_sigmas_on_either_side():
    sigmas = np.array([0.01, 0.02, 0.04])
    assert crossing(sigmas, np.array([90.0, 98.0, 100.0]), 99.0) == pytest.approx(0.02 * 2**0.5)
    assert np.isnan(crossing(sigmas, np.array([90.0, 95.0, 98.0]), 99.0))
    assert np.isnan(crossing(sigmas, np.array([99.5, 100.0, 100.0]), 99.0))


@given(st.lists(st.floats(0.0, 100.0), min_size=1, max_size=12))
def test_an_isotonic_sequence_rises_and_keeps_the_mean(values):
    found = isotonic(np.array(values))
    assert np.all(np.diff(found) >= -1e-9)
    assert found.mean() == pytest.approx(np.mean(values), abs=1e-9)
    assert isotonic(np.sort(values)) == pytest.approx(np.sort(values))


def test_capacity_against_white_noise_is_shannon_s_formula():
    generator = np.random.default_rng(0)
    density, cell_s = 1e-3, 0.02
    velocities = generator.standard_normal((2, 50_000)) * (density / 2.0 / cell_s) ** 0.5
    silent = Motion(0.0, cell_s, velocities, np.ones(50_000, dtype=np.bool_))
    frequencies_hz = np.linspace(1.0, 5.0, 500)
    lag = 1.0 / (1.0 + (2.0 * np.pi * frequencies_hz * PLANT.lag_s) ** 2)
    held = np.sinc(frequencies_hz / 50.0) ** 4
    expected = 2.0 * 4.0 * np.mean(np.log2(1.0 + 0.1**2 / 4.0 * lag * held / density))
    assert capacity_bps(PLANT, 0.1, 50.0, (1.0, 5.0), [silent]) == pytest.approx(expected, rel=0.05)
