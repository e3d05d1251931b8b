"""The C shim in the loop: the same world with either modulator ends in the same motion."""

import numpy as np

from hil.fleet.lockstep import run_lockstep
from hil.fleet.rig import RunSettings
from hil.vehicles.shim_modulator import ShimModulator
from hil.worlds.robomaster import fleet_scheme
from mtm_onboard.protocol import Key
from mtm_onboard.runtime.modulator import Modulator

SECRET = b"not a real secret, only for test"


def test_robots_move_the_same_by_c_as_by_python():
    key = Key("rig", SECRET, fleet_scheme(200))
    runs = [
        run_lockstep(RunSettings(key=key, symbols=symbols, seconds=5.5, seed=7, wire="direct", modulator=modulator))
        for symbols, modulator in (((2, 0, 3, 1), Modulator), ((2, 0, 3, 1), ShimModulator), (None, Modulator))
    ]
    python, shim, silent = (np.array([trajectory.positions_xy_m for trajectory in run.trajectories]) for run in runs)
    assert np.max(np.abs(python - shim)) < 1e-3
    assert np.max(np.abs(python - silent)) > 1e-2
    assert all(report.is_clean for report in runs[1].robots)
