import csv
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from hil.cli import main
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.proportion import Proportion
from hil.experiments.task import presence
from hil.experiments.task.drive import Course
from hil.experiments.task.noise import CLEAN, SAME_LAW, WHITE
from hil.experiments.task.presence import BANDS, WINDOWS, Presence, measure_presence, seen_velocities, window_powers
from hil.worlds.robomaster import fleet_scheme
from mtm_onboard.protocol import Codebook, generate_key, save_key
from tests.onboard.schemes import FAKE_SECRET

# Windows of two seconds.
SCHEME = fleet_scheme(100)


@pytest.fixture
def rows(tmp_path, monkeypatch):
    monkeypatch.setattr(presence, "LENGTHS_S", (6.0,))

    def measured(scheme=SCHEME, drives=80):
        with CellStore(tmp_path / "cells.jsonl") as store:
            found = measure_presence(
                {"lab": scheme}, "robomaster", drives, 0, store, Console(file=StringIO()), workers=1
            )
        return {(row.against, row.reader): row.ranked for row in found}

    return measured


def test_a_message_is_told_from_silence_but_not_from_its_law(rows):
    ranked = rows()
    assert {own.trials for own in ranked.values()} == {40}
    assert ranked[CLEAN, BANDS].percent > 85.0
    assert ranked[CLEAN, WINDOWS].percent > 85.0
    for reader in (BANDS, WINDOWS):
        low, high = ranked[SAME_LAW, reader].interval_percent
        assert low < 50.0 < high


def test_noise_that_is_not_of_the_band_would_be_noticed(rows, monkeypatch):
    monkeypatch.setattr(presence, "AGAINST", (WHITE,))
    monkeypatch.setattr(presence, "_KINDS", ("keyed", WHITE))
    assert rows()[WHITE, BANDS].percent > 80.0


def test_windows_are_read_where_there_are_two(rows):
    assert {reader for _, reader in rows(fleet_scheme(200), 8)} == {BANDS}
    assert {reader for _, reader in rows(fleet_scheme(150), 8)} == {BANDS, WINDOWS}


def test_velocities_are_along_the_robot_s_own_axes():
    rate_hz, ticks = 50.0, np.arange(501)
    heading = 1.0 + 0.5 * ticks / rate_hz
    middle = 0.5 * (heading[1:] + heading[:-1])
    steps = 0.4 / rate_hz * np.stack([np.cos(middle), np.sin(middle)], axis=1)
    places = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    driven = Course(np.column_stack([places, heading]), np.zeros((500, 3)), np.zeros((2, 2)))
    seen = seen_velocities(driven, rate_hz, 1)
    assert seen.mean(axis=0) == pytest.approx([0.4, 0.0, 0.5], abs=0.002)
    assert 0.01 < seen[:, 1].std() < 0.06


def test_windows_of_one_power_differ_less_than_gaussian_noise():
    channel = SCHEME.channels[0]
    draw = np.random.default_rng(2)
    keyed, free = np.zeros((2, 6, 1200, 3))
    for drive in range(6):
        played = Codebook(FAKE_SECRET, replace(SCHEME, schedule="fixed")).samples(channel, drive)
        keyed[drive, :, :2] = np.concatenate([played[symbol % 4].T for symbol in range(12)])
        tones = np.fft.rfft(draw.standard_normal((1200, 2)), axis=0)
        hz = np.fft.rfftfreq(1200, 0.02)
        free[drive, :, :2] = np.fft.irfft(tones * ((hz >= 0.5) & (hz <= 5.0))[:, None], 1200, axis=0)
    scatters = [window_powers(own, SCHEME)[:, 2:] for own in (keyed, free)]
    assert scatters[0].shape == (6, 2)
    assert scatters[0].max() < 1e-6 < 0.1 < scatters[1].min()


def test_a_table_is_printed_and_written(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    row = Presence(scheme="lab", plant="create", against=CLEAN, reader=BANDS, seconds=6.0, ranked=Proportion(9, 10))
    monkeypatch.setattr("hil.commands.presence.measure_presence", lambda *given, **named: [row])
    save_key(generate_key("lab", SCHEME), tmp_path / "lab.key")
    with pytest.raises(SystemExit) as left:
        main(["presence", "lab.key", "--plant", "create", "-n", "20", "--out", "p.csv", "--cells", "cells.jsonl"])
    assert (left.value.code or 0) == 0
    lines = (tmp_path / "p.csv").read_text().splitlines()
    assert lines[0] == "# mtm-hil presence lab.key --plant create -n 20 --seed 400000 --out p.csv"
    (read,) = csv.DictReader(line for line in lines if not line.startswith("#"))
    assert (read["plant"], read["pairs"], read["percent"], read["low"]) == ("create", "10", "90.00", "55.50")
    assert "90.0 [55-100]" in capsys.readouterr().out


def test_a_plant_that_does_not_drive_is_refused(tmp_path, capsys):
    save_key(generate_key("lab", SCHEME), tmp_path / "lab.key")
    with pytest.raises(SystemExit) as left:
        main(["presence", str(tmp_path / "lab.key"), "--plant", "arm", "-n", "4"])
    assert left.value.code == 2
    assert "does not drive through the fleet's arena" in capsys.readouterr().err
