import numpy as np

from hil.fleet.lockstep import run_lockstep
from hil.vehicles.shim_modulator import ShimModulator
from tests.hil.fleet.short_runs import short_run


def positions(**changes):
    return np.stack([one.positions_xy_m for one in run_lockstep(short_run(**changes)).trajectories])


def test_the_microcontroller_moves_robots_like_the_modulator():
    shim, python, silent = positions(modulator=ShimModulator), positions(), positions(symbols=None)
    # A rounding of 2**-20 m/s may cross the edge of a wheel-speed step, which is 5 mm/s for one tick.
    assert np.abs(shim - python).max() < 0.001
    assert np.abs(python - silent).max() > 0.02
