"""One message filmed by one camera: how much evidence for it the film holds.

All conditions of a seed film the same run: four robots that send one message of 8 s.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.fleet.lockstep import run_lockstep
from hil.fleet.rig import RunResult, RunSettings
from hil.sensors.camera import film
from hil.sensors.camera_motion import CameraMotion
from hil.sensors.cameras import CAMERAS, FLOORS
from hil.sensors.video import write_video
from hil.worlds.robomaster import fleet_scheme
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.ingest.load import load_tracks
from mtm_onboard.protocol import Key

MESSAGE_TICKS, LEAD_S, TAIL_S = 400, 1.0, 0.5
FRAME_RATE_HZ = 25.0
STREAM = 9


@dataclass(frozen=True)
class Condition:
    """How the camera over the arena is held, what lies on the floor, and the angle of the markers to the picture."""

    what: str
    floor: str = "mat"
    shake_px: float = 0.0
    pan_deg: float = 0.0
    roll_deg: float = 0.0
    angle_deg: float = 0.0


STILL, ANGLE = "still", "angle"
CONDITIONS = (
    *(Condition(STILL, floor) for floor in ("mat", "carpet", "markers")),
    *(Condition("shake", floor, shake_px=size) for size in (3.0, 10.0, 30.0) for floor in ("carpet", "markers")),
    *(Condition("shake and pan", floor, shake_px=3.0, pan_deg=10.0) for floor in ("carpet", "markers")),
    *(Condition("shake and roll", floor, shake_px=3.0, roll_deg=10.0) for floor in ("carpet", "markers")),
    *(Condition(ANGLE, angle_deg=float(angle)) for angle in range(0, 50, 5)),
)


def camera_cells(rollouts: int, seed: int) -> list[list[Cell]]:
    """The cells of each condition."""
    return [[Cell("cameras", asdict(condition), seed + row) for row in range(rollouts)] for condition in CONDITIONS]


def film_and_decode(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Evidence in `bits` of one film, whether its message was `right`, and the share of frames in which robots show."""
    condition = Condition(**parameters)  # type: ignore[arg-type]
    key, symbols, run = sent_run(seed)
    overhead = CAMERAS["overhead"]
    motion = CameraMotion(
        shake_px=condition.shake_px,
        pan_rad=math.radians(condition.pan_deg),
        roll_rad=math.radians(condition.roll_deg),
    )
    camera = replace(
        overhead,
        rate_hz=FRAME_RATE_HZ,
        optics=replace(overhead.optics, roll_rad=math.radians(condition.angle_deg)),
        motion=None if motion == CameraMotion() else motion,
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        frames = film(camera, FLOORS[condition.floor], list(run.trajectories), np.random.default_rng([STREAM, seed]))
        write_video(frames, path, FRAME_RATE_HZ)
        tracks = load_tracks(path)
    decoding = decode_tracks(tracks, key, DecodeSettings())
    robots = [track for track in tracks if track.name in {f"marker{number}" for number in range(4)}]
    return {
        "bits": (decoding.evidence.nats or 0.0) / math.log(2.0),
        "right": decoding.verdict == "decoded" and decoding.symbols == symbols,
        "seen": float(np.mean([track.valid.mean() for track in robots])),
    }


def sent_run(seed: int) -> tuple[Key, tuple[int, ...], RunResult]:
    """The key, the symbols and the run of a seed, which all conditions film."""
    draw = np.random.default_rng([STREAM, seed])
    key = Key("cameras", draw.bytes(32), fleet_scheme(MESSAGE_TICKS))
    symbols = tuple(int(symbol) for symbol in draw.integers(0, key.scheme.alphabet_size, key.scheme.message_symbols))
    seconds = LEAD_S + MESSAGE_TICKS / key.scheme.rate_hz + TAIL_S
    settings = RunSettings(key=key, symbols=symbols, seconds=seconds, seed=seed, wire="direct", start_s=LEAD_S)
    return key, symbols, run_lockstep(settings)


@dataclass(frozen=True, kw_only=True)
class Row:
    """One condition: mean evidence, as a share of what it is measured by, and how many messages were read right."""

    condition: Condition
    bits: float
    share: float
    right: int
    rollouts: int
    seen: float


def rows_of(results: Sequence[Sequence[Values]]) -> list[Row]:
    """The table: shares are those of the still camera over the same floor, and of the best angle."""
    bits = [float(np.mean([float(result["bits"]) for result in own])) for own in results]
    still = {
        condition.floor: value for condition, value in zip(CONDITIONS, bits, strict=True) if condition.what == STILL
    }
    best = max(value for condition, value in zip(CONDITIONS, bits, strict=True) if condition.what == ANGLE)
    return [
        Row(
            condition=condition,
            bits=value,
            share=value / (best if condition.what == ANGLE else still[condition.floor]),
            right=sum(bool(result["right"]) for result in own),
            rollouts=len(own),
            seen=float(np.mean([float(result["seen"]) for result in own])),
        )
        for condition, value, own in zip(CONDITIONS, bits, results, strict=True)
    ]
