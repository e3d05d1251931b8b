"""How often a verdict is wrong when there is nothing to read: wrong keys, and recordings without a message.

These are the paper's null conditions (Section "Null Conditions", tab:null) under varied circumstances. One cell is one
rollout of four robots, each decoded by itself under a key that its motion does not carry; in one cell of sixteen all
are decoded together, from tracks that do not name the robots. Scheme, length of the recording, where in the task it
begins, the robots' tasks, the camera and the frame times are drawn from the cell's seed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings
from hil.plants.mecanum import calibrated_parameters
from hil.sensors.motion_capture import MotionCapture
from hil.sensors.optics import Optics
from hil.worlds.robomaster import ROBOTS, fleet_scheme
from hil.worlds.tasks import random_task
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.track import Floats, Track
from mtm_onboard.protocol import Channel, Key, Scheme

WRONG_KEY, NO_MESSAGE = "wrong key", "no message"
_STREAM = 3
_LONGEST_S = 20.0
_WINDOWS_TICKS = (100, 150, 200, 300)
_ALPHABETS = (2, 4, 16)
_PIXELS_PER_M = 150.0
# Matching four tracks to four robots takes twenty readings instead of four, so such a cell must be rare and short.
_CELLS_PER_FLEET = 16
_FLEET_LONGEST_WINDOWS = 1.5


@dataclass(frozen=True)
class Summary:
    """One arm: `p_values` (decodes,), and the number of verdicts "decoded" and "inconclusive".

    `uniformity` is the Kolmogorov-Smirnov p-value of the p-values against a uniform law.
    """

    arm: str
    p_values: Floats
    decoded: int
    inconclusive: int
    uniformity: float


def false_alarm_cells(arm: str, decodes: int, detector: str, first_seed: int) -> list[Cell]:
    """Cells with at least `decodes` decodes in total; one that decodes the whole fleet together has one decode."""
    cells: list[Cell] = []
    while decodes > 0:
        seed = first_seed + len(cells)
        cells.append(Cell("false alarms", {"arm": arm, "detector": detector}, seed))
        decodes -= 1 if _is_fleet(seed) else ROBOTS
    return cells


def decode_nothing(parameters: Values, seed: int) -> dict[str, Scalar]:
    """P-value and verdict of each decode of one rollout, whose motion does not carry what is decoded."""
    draw = np.random.default_rng([_STREAM, seed])
    scheme = replace(fleet_scheme(int(draw.choice(_WINDOWS_TICKS))), alphabet_size=int(draw.choice(_ALPHABETS)))
    symbols = tuple(int(symbol) for symbol in draw.integers(0, scheme.alphabet_size, ROBOTS))
    played = Key("played", draw.bytes(32), scheme)
    tracks = _recorded(played, symbols if parameters["arm"] == WRONG_KEY else None, seed, draw)
    known = bool(draw.random() < 0.5)
    result: dict[str, Scalar] = {}
    for number, (asked, shown) in enumerate(_asked(scheme, tracks, seed)):
        onset_s = float(shown[0].times_s[0]) + 0.02 if known else None
        settings = DecodeSettings(detector=str(parameters["detector"]), onset_s=onset_s)
        decoding = decode_tracks(shown, Key("asked", draw.bytes(32), asked), settings)
        result[f"p{number}"] = decoding.evidence.p_value
        result[f"verdict{number}"] = decoding.verdict
    return result


def _is_fleet(seed: int) -> bool:
    return seed % _CELLS_PER_FLEET == 0


def _asked(scheme: Scheme, tracks: Sequence[Track], seed: int) -> list[tuple[Scheme, list[Track]]]:
    """What is decoded: each robot by itself, or all together from tracks that do not name them."""
    if _is_fleet(seed):
        return [
            (scheme, [replace(track, name=f"shape {letter}") for letter, track in zip("abcd", tracks, strict=True)])
        ]
    return [(_alone(scheme, robot), [track]) for robot, track in enumerate(tracks)]


def _recorded(played: Key, sent: tuple[int, ...] | None, seed: int, draw: np.random.Generator) -> list[Track]:
    """The tracks of a part of one rollout in the picture of one camera."""
    window_s = played.scheme.message_ticks / played.scheme.rate_hz
    most_s = _FLEET_LONGEST_WINDOWS * window_s if _is_fleet(seed) else min(_LONGEST_S, 4.0 * window_s)
    length_s = float(draw.uniform(window_s, max(1.2 * window_s, most_s)))
    begin_s = float(draw.uniform(0.3, 8.0))
    settings = RunSettings(
        key=played,
        symbols=sent,
        seconds=begin_s + length_s + 0.2,
        seed=seed,
        wire="direct",
        start_s=0.2,
        task=random_task,
        plant=calibrated_parameters(),
    )
    rate_hz, dropouts = float(draw.choice((25.0, 30.0, 50.0, 100.0))), float(draw.choice((0.0, 0.05)))
    system = MotionCapture(rate_hz=rate_hz, dropout_probability=dropouts)
    tracks = motion_capture_tracks(run_lockstep(settings), seed, system)
    camera = _camera(draw)
    return [_observed_track(_cut(track, begin_s, begin_s + length_s), camera, draw) for track in tracks]


def summarise(arm: str, results: Sequence[Values]) -> Summary:
    """The decodes of an arm together."""
    p_values = np.array([float(value) for result in results for name, value in result.items() if name[0] == "p"])
    verdicts = [str(value) for result in results for name, value in result.items() if name[0] == "v"]
    uniformity = float(stats.kstest(p_values, "uniform").pvalue)
    return Summary(arm, p_values, verdicts.count("decoded"), verdicts.count("inconclusive"), uniformity)


def _alone(scheme: Scheme, robot: int) -> Scheme:
    channel = scheme.channels[robot]
    return replace(scheme, channels=(Channel(channel.name, channel.body, channel.axes, 1, channel.sigma),))


def _cut(track: Track, start_s: float, end_s: float) -> Track:
    rows = (track.times_s >= start_s) & (track.times_s <= end_s)
    return Track(track.name, track.times_s[rows], track.positions[rows], track.valid[rows], track.axes, track.unit)


def _camera(draw: np.random.Generator) -> Optics:
    """A camera anywhere above the arena, rolled, perhaps mirrored, that looks at about its centre."""
    turn_rad, tilt_rad, roll_rad = (float(draw.uniform(0.0, most)) for most in (2.0 * np.pi, 1.0, 2.0 * np.pi))
    distance_m = float(draw.uniform(6.0, 10.0))
    across_m = distance_m * math.sin(tilt_rad)
    position_m = (across_m * math.cos(turn_rad), across_m * math.sin(turn_rad), distance_m * math.cos(tilt_rad))
    target_m = (float(draw.uniform(-0.5, 0.5)), float(draw.uniform(-0.5, 0.5)), 0.0)
    mirrored = bool(draw.random() < 0.5)
    return Optics(
        position_m=position_m,
        target_m=target_m,
        focal_px=_PIXELS_PER_M * distance_m,
        roll_rad=roll_rad,
        mirrored=mirrored,
    )


def _observed_track(track: Track, camera: Optics, draw: np.random.Generator) -> Track:
    """The track in the picture, y up, with the tracker's noise."""
    ground = np.column_stack([track.positions, np.zeros(len(track.positions))])
    pixels = camera.project(ground) * [1.0, -1.0]
    return replace(track, positions=pixels + draw.normal(0.0, 0.1, pixels.shape), unit="px")
