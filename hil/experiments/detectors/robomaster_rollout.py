"""One rollout of the paper's RoboMaster experiment (appendix "RoboMaster: Numerical Results"), decoded by its detector.

Each rollout draws a key and a permutation of its own; the robots' symbols are the numbers of the targets that they
drive to. The auditor has motion capture and knows when the message began.
"""

from dataclasses import asdict

import numpy as np

from hil.experiments.runs.cells import Scalar, Values
from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings, seeds_of
from hil.plants.mecanum import MecanumParameters
from hil.sensors.motion_capture import MotionCapture
from hil.worlds.robomaster import ROBOTS, fleet_scheme
from mtm_audit.detectors.coherency import rate_searched_scores
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Codebook, Key

SENT, WRONG_KEY, NO_MESSAGE = "message", "wrong key", "no message"

_START_S = 1.5
# The slowest rate searched, 0.8 of the true one, looks at 1.25 windows of motion.
_LONGEST_WINDOW = 1.25
_KEYS_STREAM = 1


def rollout_parameters(arm: str, message_ticks: int, plant: MecanumParameters, decoys: int = 0) -> dict[str, Scalar]:
    """Parameters of a cell for `decode_rollout`: which arm, T, and how many wrong keys try each rollout."""
    return {"arm": arm, "message_ticks": message_ticks, "decoys": decoys, **asdict(plant)}


def decode_rollout(parameters: Values, seed: int) -> dict[str, Scalar]:
    """`decodes` of one rollout, how many of them were `correct`, and the mean `margin`.

    The margin of a decode is the score of the robot's symbol minus that of the best other.
    """
    given = dict(parameters)
    arm, ticks, decoys = str(given.pop("arm")), int(given.pop("message_ticks")), int(given.pop("decoys"))
    plant = MecanumParameters(**{name: float(value) for name, value in given.items()})
    secrets = np.random.default_rng([_KEYS_STREAM, seed])
    key = Key("rollout", secrets.bytes(32), fleet_scheme(ticks))
    symbols = seeds_of(seed).permutation()
    seconds = _START_S + _LONGEST_WINDOW * ticks / key.scheme.rate_hz + 0.1
    sent = None if arm == NO_MESSAGE else symbols
    settings = RunSettings(
        key=key, symbols=sent, seconds=seconds, seed=seed, wire="direct", start_s=_START_S, plant=plant
    )
    result = run_lockstep(settings)
    glimpses = [glimpse_of_track(track) for track in motion_capture_tracks(result, seed, MotionCapture())]
    codebooks = [key.codebook()]
    if arm == WRONG_KEY:
        codebooks = [Codebook(secrets.bytes(32), key.scheme) for _ in range(decoys)]
    margins = [
        _margin(rate_searched_scores(codebook, channel, glimpse, _START_S, 0), symbol)
        for codebook in codebooks
        for channel, glimpse, symbol in zip(key.scheme.channels, glimpses, symbols, strict=True)
    ]
    correct = sum(margin > 0.0 for margin in margins)
    return {"decodes": len(codebooks) * ROBOTS, "correct": correct, "margin": float(np.mean(margins))}


def _margin(scores: Floats, symbol: int) -> float:
    return float(scores[symbol] - np.delete(scores, symbol).max())
