"""How often a verdict is wrong when there is nothing to read: wrong keys, and recordings without a message.

One cell is one rollout of four robots, each decoded by itself under a key that its motion does not carry. Schemes,
lengths of the recording, where in the task it begins, what the robots do, the view and the frames differ from cell to
cell, all drawn from the cell's seed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from hil.experiments.cells import Cell, Scalar, Values
from hil.lockstep import run_lockstep
from hil.recording import motion_capture_tracks
from hil.rig import RunSettings
from hil.robots.mecanum import calibrated_parameters
from hil.sensors.motion_capture import MotionCapture
from hil.worlds.robomaster import ROBOTS, fleet_scheme
from mtm_audit.decode import DecodeSettings, decode_tracks
from mtm_audit.tracks import Floats, Track
from mtm_onboard.protocol import Channel, Key, Scheme

WRONG_KEY, NO_MESSAGE = "wrong key", "no message"
_STREAM = 3
_LONGEST_S = 20.0
_WINDOWS_TICKS = (100, 150, 200, 300)
_ALPHABETS = (2, 4, 16)


@dataclass(frozen=True)
class Summary:
    """One arm: `p_values` (decodes,), and how many were called decoded and how many inconclusive.

    `uniformity` is the Kolmogorov-Smirnov p-value of the p-values against a uniform law.
    """

    arm: str
    p_values: Floats
    decoded: int
    inconclusive: int
    uniformity: float


def false_alarm_cells(arm: str, decodes: int, detector: str, first_seed: int) -> list[Cell]:
    """As many rollouts as give at least `decodes` decodes."""
    rollouts = -(-decodes // ROBOTS)
    return [Cell("false alarms", {"arm": arm, "detector": detector}, first_seed + row) for row in range(rollouts)]


def decode_nothing(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Run one rollout and decode each robot under a key that is not in its motion: p-value and verdict of each."""
    draw = np.random.default_rng([_STREAM, seed])
    scheme = replace(fleet_scheme(int(draw.choice(_WINDOWS_TICKS))), alphabet_size=int(draw.choice(_ALPHABETS)))
    played = Key("played", draw.bytes(32), scheme)
    symbols = tuple(int(symbol) for symbol in draw.integers(0, scheme.alphabet_size, ROBOTS))
    window_s = scheme.message_ticks / scheme.rate_hz
    length_s = float(draw.uniform(window_s, max(1.2 * window_s, min(_LONGEST_S, 4.0 * window_s))))
    begin_s = float(draw.uniform(0.3, 8.0))
    sent = symbols if parameters["arm"] == WRONG_KEY else None
    settings = RunSettings(
        played, sent, begin_s + length_s + 0.2, seed, wire="direct", start_s=0.2, plant=calibrated_parameters()
    )
    rate_hz, dropouts = float(draw.choice((25.0, 30.0, 50.0, 100.0))), float(draw.choice((0.0, 0.05)))
    camera = MotionCapture(rate_hz=rate_hz, dropout_probability=dropouts)
    tracks = motion_capture_tracks(run_lockstep(settings), seed, camera)
    known = bool(draw.random() < 0.5)
    result: dict[str, Scalar] = {}
    for robot, track in enumerate(tracks):
        seen = _viewed(_cut(track, begin_s, begin_s + length_s), draw)
        key = Key("asked", draw.bytes(32), _alone(scheme, robot))
        onset_s = float(seen.times_s[0]) + 0.02 if known else None
        decoding = decode_tracks([seen], key, DecodeSettings(detector=str(parameters["detector"]), onset_s=onset_s))
        result[f"p{robot}"] = decoding.evidence.p_value
        result[f"verdict{robot}"] = decoding.verdict
    return result


def summarise(arm: str, results: Sequence[Values]) -> Summary:
    """Collect an arm's decodes."""
    p_values = np.array([float(result[f"p{robot}"]) for result in results for robot in range(ROBOTS)])
    verdicts = [str(result[f"verdict{robot}"]) for result in results for robot in range(ROBOTS)]
    uniformity = float(stats.kstest(p_values, "uniform").pvalue)
    return Summary(arm, p_values, verdicts.count("decoded"), verdicts.count("inconclusive"), uniformity)


def _alone(scheme: Scheme, robot: int) -> Scheme:
    channel = scheme.channels[robot]
    return replace(scheme, channels=(Channel(channel.name, channel.body, channel.axes, 1, channel.sigma),))


def _cut(track: Track, start_s: float, end_s: float) -> Track:
    rows = (track.times_s >= start_s) & (track.times_s <= end_s)
    return Track(track.name, track.times_s[rows], track.positions[rows], track.valid[rows], track.axes, track.unit)


def _viewed(track: Track, draw: np.random.Generator) -> Track:
    """The track as a far camera sees it: turned, foreshortened, perhaps mirrored, in pixels, with its own noise."""
    angle, tilt = draw.uniform(0.0, 2.0 * np.pi), draw.uniform(0.0, 1.0)
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    view = 150.0 * np.diag([1.0, np.cos(tilt) * draw.choice([-1.0, 1.0])]) @ rotation
    positions = track.positions @ view.T + draw.normal(0.0, 0.1, track.positions.shape)
    return replace(track, positions=positions, unit="px")
