"""Logs of a simulated robot whose response and interference are known."""

import numpy as np

from hil.plants.linear_response import LinearResponse
from hil.plants.plant_file import IdentifiedAxis, IdentifiedRobot
from hil.plants.robots import STEP_S, driven

AHEAD = IdentifiedAxis(LinearResponse(gain=0.8, delay_s=0.2, lag_s=0.15), 0.02, 0.1)
TURN = IdentifiedAxis(LinearResponse(gain=0.9, delay_s=0.1, natural_hz=1.5, damping=0.6), 0.1, 0.1)
ROBOT = IdentifiedRobot("known", {"vx": AHEAD, "wz": TURN})


def driven_logs(seconds=300.0, seed=1, start_s=100.0):
    """Times, commands (n, 3) and poses (n, 3); commands are new every 0.2 s."""
    draw = np.random.default_rng(seed)
    count = round(seconds / STEP_S)
    held = np.repeat(draw.uniform(-1.0, 1.0, (count // 20, 3)) * [0.2, 0.0, 0.5] + [0.3, 0.0, 0.0], 20, axis=0)
    poses = driven(ROBOT.robot(), held, draw) + draw.normal(0.0, [0.0002, 0.0002, 0.001], held.shape)
    return start_s + np.arange(count) * STEP_S, held, poses


def write_mrclam(folder, name="Robot1", seconds=300.0, seed=1):
    times_s, commands, poses = driven_logs(seconds, seed)
    odometry, truth = folder / f"{name}_Odometry.dat", folder / f"{name}_Groundtruth.dat"
    np.savetxt(odometry, np.column_stack([times_s, commands[:, [0, 2]]]), fmt="%.3f", header="Odometry")
    poses[:, 2] = np.angle(np.exp(1j * poses[:, 2]))
    # A pose is that after the step.
    np.savetxt(truth, np.column_stack([times_s + STEP_S, poses]), fmt="%.6f", header="Groundtruth")
    return odometry, truth
