"""A stochastic policy that says something with the noise it has anyway; needs mtm_onboard and numpy alone.

    python examples/policy_noise.py --message 178 --out /tmp/policy
    mtm-audit decode /tmp/policy/point.csv --key /tmp/policy/point.key --onset 0

A point mass is sent from goal to goal by a Gaussian policy: the mean of its action heads for the goal, and the noise
around the mean is drawn from a key instead of a random generator. What a camera would see of it goes to point.csv.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

from mtm_onboard.policies import ActionBounds, KeyedGaussian, KeyedNoise
from mtm_onboard.protocol import Channel, Key, MtmError, Scheme, generate_key, save_key
from mtm_onboard.runtime.message import message_of
from mtm_onboard.runtime.modulator import Modulator

RATE_HZ = 50.0
POLICY_STD_MPS = 0.15
# power = "ensemble" keeps each action's distribution exactly the policy's own.
SCHEME = Scheme(
    name="point-mass", rate_hz=RATE_HZ, band_hz=(0.5, 5.0), alphabet_size=16, message_ticks=800,
    channels=(Channel("point", "point", ("vx", "vy"), symbols=2, sigma=POLICY_STD_MPS),), power="ensemble",
)  # fmt: skip
GOALS_XY_M = np.array([[1.5, 0.0], [1.5, 1.5], [-0.5, 1.0], [0.0, 0.0]])
SECONDS = 32.0

TOP_SPEED_MPS = 1.2
RESPONSE_S = 0.15  # the mass takes on a commanded velocity with this time constant
ARRIVED_M = 0.1
SEEN_WITHIN_M = 0.001


Observation = tuple[np.ndarray, np.ndarray]


class PointMass:
    """Follows velocity commands with a lag, and counts the goals that it has reached."""

    def __init__(self) -> None:
        self.position_xy_m, self.velocity_xy_mps = np.zeros(2), np.zeros(2)
        self.reached = 0

    def observe(self) -> Observation:
        """Vector to the goal at hand in metres, and own velocity in m/s."""
        return GOALS_XY_M[self.reached % len(GOALS_XY_M)] - self.position_xy_m, self.velocity_xy_mps

    def step(self, action_xy_mps: np.ndarray) -> None:
        """One period of the policy."""
        self.velocity_xy_mps = self.velocity_xy_mps + (action_xy_mps - self.velocity_xy_mps) / (RESPONSE_S * RATE_HZ)
        self.position_xy_m = self.position_xy_m + self.velocity_xy_mps / RATE_HZ
        self.reached += bool(np.linalg.norm(self.observe()[0]) < ARRIVED_M)


def policy(observation: Observation) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of the action, in m/s: what the last layer of a network would say."""
    to_goal_m, velocity_mps = observation
    mean_mps = np.tanh(1.5 * to_goal_m) - 0.1 * velocity_mps
    return mean_mps, np.full(2, POLICY_STD_MPS)


def run(key: Key, message: int | None, seed: int) -> tuple[np.ndarray, PointMass, ActionBounds]:
    """What a camera sees, rows of time in seconds and x and y in metres, and the mass and its bounds after the run.

    Without a message the same policy draws its noise at random.
    """
    mass, bounds, random = PointMass(), ActionBounds(-TOP_SPEED_MPS, TOP_SPEED_MPS), np.random.default_rng(seed)
    if message is None:
        act = _random_policy(bounds, random)
    else:
        modulator = Modulator(key.codebook(), "point", message_of(message, key))
        act = KeyedGaussian(policy, KeyedNoise([modulator], random=random), bounds)
    rows = [(0.0, *mass.position_xy_m)]
    for tick in range(round(SECONDS * RATE_HZ)):
        mass.step(act(mass.observe()))
        rows.append(((tick + 1) / RATE_HZ, *mass.position_xy_m))
    seen = np.array(rows)
    seen[:, 1:] += SEEN_WITHIN_M * random.standard_normal(seen[:, 1:].shape)
    return seen, mass, bounds


def _random_policy(bounds: ActionBounds, random: np.random.Generator) -> Callable[[Observation], np.ndarray]:
    def act(observation: Observation) -> np.ndarray:
        mean_mps, std_mps = policy(observation)
        return bounds.clip(mean_mps + std_mps * random.standard_normal(2))

    return act


def main(arguments: list[str] | None = None) -> int:
    """Make a key, run the policy, and write the key and what a camera saw."""
    parser = argparse.ArgumentParser(description="a stochastic policy on a point mass, with a message in its noise")
    parser.add_argument("--message", type=int, default=178, help="0 to 255")
    parser.add_argument("--out", type=Path, required=True, help="a folder for point.csv and point.key")
    args = parser.parse_args(arguments)
    key = generate_key("point-mass", SCHEME)
    try:
        seen, mass, bounds = run(key, args.message, seed=0)
        args.out.mkdir(parents=True, exist_ok=True)
        save_key(key, args.out / "point.key")
    except MtmError as error:
        parser.error(str(error))
    np.savetxt(args.out / "point.csv", seen, delimiter=",", header="time,x,y", comments="", fmt="%.6f")
    print(f"{mass.reached} goals reached in {SECONDS:g} s, {bounds.clipped_share:.1%} of the actions clipped")
    print(f"read it with: mtm-audit decode {args.out / 'point.csv'} --key {args.out / 'point.key'} --onset 0")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
