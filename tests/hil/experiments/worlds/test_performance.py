import numpy as np
import pytest
from rich.console import Console

from hil.experiments.runs.cells import CellStore
from hil.experiments.worlds.performance import CLEAN, KEYED, WHITE, Measure, conditions_of, measure, measures, write_csv
from hil.worlds.world import ControlHistory


def control(asked, sent):
    return ControlHistory(sent, asked, sent, {"episodic return": 3.0})


def test_a_steady_command_has_energy_and_no_jerk():
    steady = np.full((50, 2), 0.5)
    found = measures("lunar-lander", control(steady, steady), 50.0)
    assert found["episodic return"] == 3.0
    assert found["energy, mean square command"] == pytest.approx(0.5)
    assert found["jerk, root mean square"] == 0.0
    assert found["commands at the limit"] == 0.0


def test_a_force_s_jerk_is_slope_and_a_velocity_s_curvature():
    times_s = np.arange(100)[:, None] / 10
    assert measures("football", control(2 * times_s, 2 * times_s), 10.0)["jerk, root mean square"] == pytest.approx(2.0)
    bent = 3 * times_s**2
    assert measures("discovery", control(bent, bent), 10.0)["jerk, root mean square"] == pytest.approx(6.0)


def test_commands_beyond_the_limit_are_counted():
    asked = np.array([[1.5], [0.5], [-2.0], [0.1]])
    assert measures("football", control(asked, np.clip(asked, -1, 1)), 10.0)["commands at the limit"] == 0.5


def test_a_stochastic_policy_has_no_clean_controller():
    assert conditions_of("reacher") == (WHITE, KEYED)
    assert conditions_of("football") == (CLEAN, WHITE, KEYED)


def test_the_arm_s_return_is_measured_beside_the_paper_s(tmp_path):
    with CellStore(tmp_path / "cells.jsonl") as store:
        rows = measure(["reacher"], 2, 0, store, Console(quiet=True), workers=1)
    returns = {row.condition: row for row in rows if row.name == "50-step return"}
    assert returns[KEYED].paper == "-4.15±1.23"
    assert -20.0 < returns[KEYED].mean < 0.0
    write_csv(tmp_path / "control.csv", rows, "made by hand")
    assert "reacher,50-step return,watermarked,2," in (tmp_path / "control.csv").read_text()


def test_a_measure_that_the_paper_lacks_has_no_figure_of_it():
    assert Measure("football", KEYED, "jerk, root mean square", 50, 1.0, 0.1).paper == ""
