from dataclasses import asdict, replace

import numpy as np
import pytest
from rich.console import Console

from hil.commands.bench_rates import RatesOptions, bench_rates
from hil.experiments.detectors import rates as module
from hil.experiments.detectors.rates import RateJob, job_capacity_bps, rate_rows, read_rate
from hil.experiments.detectors.rates_genie import _held
from hil.experiments.runs.cells import CellStore
from hil.plants.mecanum import MecanumPlant, calibrated_parameters
from hil.worlds.robomaster import heading_held
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import MtmError

PLANT = calibrated_parameters()
SMALL = RateJob(16, 100, yaw=True)


def test_the_rates_are_those_asked_for():
    assert [(round(job.rate_bps, 1), len(job.scheme.channels[0].axes)) for job in module.JOBS] == [
        (5.0, 2),
        (6.0, 2),
        (6.0, 2),
        (8.0, 3),
    ]


def test_a_small_alphabet_on_three_axes_is_read_whole():
    assert read_rate({**asdict(SMALL), **asdict(PLANT)}, 5) == {"matched": 16, "genie": 16}


def test_more_symbols_than_anyone_can_read_are_not_all_right():
    """Where wheels slip ten times as much even the genie guesses."""
    quiet = replace(PLANT, slip_mps=10.0 * PLANT.slip_mps, yaw_slip_radps=10.0 * PLANT.yaw_slip_radps)
    found = read_rate({**asdict(RateJob(256, 50, yaw=True)), **asdict(quiet)}, 5)
    assert max(found.values()) < 8


def test_yaw_adds_capacity():
    planar, whole = (job_capacity_bps(RateJob(16, 100, yaw=yaw), PLANT) for yaw in (False, True))
    assert 8.0 < planar < 10.0
    assert whole > planar + 5.0


def test_the_genie_knows_how_the_held_heading_answers():
    """What it expects of a turn is what the chassis does whose controller turns it back."""
    still = replace(PLANT, slip_mps=0.0, yaw_slip_radps=0.0, wheel_step_rpm=0.0)
    noise = np.zeros(100)
    noise[3:20] = 0.4
    plant, commanded = MecanumPlant(still, 0), []
    for tick, added in enumerate(noise):
        plant.step(tick * 0.02)
        base = heading_held(0.0, 0.0, plant.heading_rad)
        commanded.append(base.wz_radps + added)
        plant.command(tick * 0.02 + 0.01, BodyVelocity(0.0, 0.0, commanded[-1]))
    assert _held(still, 100, 50.0) @ noise == pytest.approx(np.array(commanded), abs=0.02)


def test_finished_rollouts_are_not_computed_again(tmp_path, monkeypatch):
    console = Console()
    with CellStore(tmp_path / "cells.jsonl") as store:
        (first,) = rate_rows([SMALL], PLANT, 2, store, console, workers=1)
        monkeypatch.setattr(module, "read_rate", lambda *asked: pytest.fail("computed again"))
        (again,) = rate_rows([SMALL], PLANT, 2, store, console, workers=1)
    assert again == first
    assert first.symbols["genie"].trials == 32


def test_the_command_writes_its_table_and_knows_its_rates(tmp_path, monkeypatch):
    monkeypatch.setattr("hil.commands.bench_rates.JOBS", (SMALL,))
    out = tmp_path / "rates.csv"
    bench_rates(RatesOptions("16x100+yaw", 1, out, tmp_path / "cells.jsonl"), Console())
    lines = [line for line in out.read_text().splitlines() if not line.startswith("#")]
    assert lines[1].startswith("2.00,16,100,vx vy wz,1,16,100.00,")
    with pytest.raises(MtmError, match="there is no rate '4x1'; choose all or some of: 16x100\\+yaw"):
        bench_rates(RatesOptions("4x1", 1, None, tmp_path / "cells.jsonl"), Console())
