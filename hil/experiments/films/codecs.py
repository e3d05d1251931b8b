"""How much evidence for a message is left in a film, by codec, quality, pixels per metre and loudness.

One cell is one rollout of the paper's four robots, sent at one sigma and filmed from above at one number of pixels a
metre. The film is kept without loss, and every coding is made from it, so that codings are compared on one motion.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from hil.experiments.films.coding import CODINGS, LOSSLESS, Coding
from hil.experiments.runs.cells import Scalar, Values
from hil.fleet.lockstep import run_lockstep
from hil.fleet.recording import motion_capture_tracks
from hil.fleet.rig import RunSettings
from hil.sensors.camera import Camera, film
from hil.sensors.film_qualities import write_quality
from hil.sensors.motion_capture import MotionCapture
from hil.sensors.optics import overhead
from hil.sensors.scene import Scene
from hil.worlds.robomaster import ROBOTS, fleet_scheme
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.ingest.recording import read_recording
from mtm_audit.model.track import Track
from mtm_audit.readers.video import read_frames
from mtm_onboard.protocol import Key, MtmError

_STREAM = 1504
_START_S, _SECONDS, _RATE_HZ = 1.0, 14.0, 30.0
_SPAN_M = 4.6
SIGMAS_MPS = (0.05, 0.1)
PIXELS_PER_METRE = (100, 160)


@dataclass(frozen=True)
class Filmed:
    """One coding of one rollout: evidence in bits, whether it was decoded right, and the film's bits a pixel."""

    coding: Coding
    evidence_bits: float
    decoded: bool
    bits_per_pixel: float
    kbit_s: float


def film_under_all(parameters: Values, seed: int) -> dict[str, Scalar]:
    """The evidence of one rollout in motion capture and under each coding.

    `parameters` are `sigma_mps` and `pixels_per_metre`. A film in which no marker is found has no evidence.
    """
    draw = np.random.default_rng([_STREAM, seed])
    plain = fleet_scheme()
    loud = tuple(replace(channel, sigma=float(parameters["sigma_mps"])) for channel in plain.channels)
    key = Key("filmed", draw.bytes(32), replace(plain, channels=loud))
    symbols = tuple(int(symbol) for symbol in draw.integers(0, plain.alphabet_size, ROBOTS))
    run = run_lockstep(
        RunSettings(key=key, symbols=symbols, seconds=_SECONDS, seed=seed, wire="direct", start_s=_START_S)
    )
    captured = _decode(motion_capture_tracks(run, seed, MotionCapture()), key)
    result: dict[str, Scalar] = {"motion capture bits": captured.evidence.bits}
    side_px = 2 * round(_SPAN_M * int(parameters["pixels_per_metre"]) / 2)
    camera = Camera(optics=overhead(_SPAN_M, width_px=side_px, height_px=side_px), noise_levels=1.5, blur_px=0.6)
    with TemporaryDirectory() as folder:
        whole = Path(folder) / "whole.mp4"
        frames = film(camera, Scene(), list(run.trajectories), np.random.default_rng([_STREAM, seed, 1]))
        write_quality(frames, whole, _RATE_HZ, LOSSLESS)
        for coding in CODINGS:
            result |= _under(coding, whole, Path(folder) / "copy.mp4", side_px, key, symbols)
    return result


def filmed(result: Values, coding: Coding) -> Filmed:
    """What a cell's result says of one coding."""
    value = {field: result[f"{coding.name} {field}"] for field in ("bits", "decoded", "bits a pixel", "kbit/s")}
    return Filmed(
        coding, float(value["bits"]), bool(value["decoded"]), float(value["bits a pixel"]), float(value["kbit/s"])
    )


def motion_px(sigma_mps: float, pixels_per_metre: float) -> float:
    """Root mean square of the noise's displacement along one axis in pixels, if the robot followed it exactly.

    Tones of equal mean power at all bins of the band: the mean square of the displacement is sigma^2 times the mean of
    1 / (2 pi f)^2 over them.
    """
    scheme = fleet_scheme()
    spacing_hz = scheme.rate_hz / scheme.message_ticks
    first, last = (round(edge / spacing_hz) for edge in scheme.band_hz)
    tones_hz = spacing_hz * np.arange(first, last + 1)
    return pixels_per_metre * sigma_mps * float(np.sqrt(np.mean((2.0 * np.pi * tones_hz) ** -2.0)))


def _under(
    coding: Coding, whole: Path, copy: Path, side_px: int, key: Key, symbols: tuple[int, ...]
) -> Mapping[str, Scalar]:
    count = write_quality(read_frames(whole, "bgr"), copy, _RATE_HZ, coding.film)
    size_bits = 8.0 * copy.stat().st_size
    pixels = count * (side_px * coding.film.scale) ** 2
    try:
        recording = read_recording((copy,), "video")
        decoding = _decode(recording.tracks, key)
        bits, decoded = decoding.evidence.bits, decoding.verdict == "decoded" and decoding.symbols == symbols
    except MtmError:
        bits, decoded = 0.0, False
    return {
        f"{coding.name} bits": bits,
        f"{coding.name} decoded": decoded,
        f"{coding.name} bits a pixel": size_bits / pixels,
        f"{coding.name} kbit/s": size_bits / 1000.0 / _SECONDS,
    }


def _decode(tracks: "tuple[Track, ...] | list[Track]", key: Key) -> Decoding:
    return decode_tracks(tracks, key, DecodeSettings(onset_s=_START_S))
