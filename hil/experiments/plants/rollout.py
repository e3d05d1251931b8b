"""One message of one robot of the family, read by coherency, matched and the linear genie."""

import hashlib
import zlib
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from hil.experiments.detectors.linear_genie import axis_motion, genie_scores
from hil.experiments.plants.genie import knowledge_of
from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.fleet.driven import sent_track
from hil.fleet.sending import Sending
from hil.worlds.vehicles import vehicle
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.track import Track
from mtm_onboard.protocol import Channel, Key, MtmError, Scheme
from mtm_onboard.protocol.framing import number_of_symbols

ONSET_S = 1.5
DETECTORS = ("coherency", "matched", "genie")
# Reported seeds count from here.
FIRST_SEED = 900_000

_STREAM = 721
_AFTER_S = 0.5
# The slowest rate that the paper's detector tries, 0.8 of the true one, looks at 1.25 messages of motion.
_LONGEST_MESSAGE = 1.25


@dataclass(frozen=True)
class PlantJob:
    """`windows` symbols of an alphabet, `ticks` each, at `sigma` (m/s and rad/s), sent again and again."""

    alphabet_size: int = 16
    ticks: int = 100
    windows: int = 4
    sigma: float = 0.1

    def scheme(self, axes: tuple[str, ...]) -> Scheme:
        """The scheme for one robot with these axes; raises MtmError when it cannot be played."""
        return Scheme(
            name="plants",
            rate_hz=50.0,
            band_hz=(0.5, 5.0),
            alphabet_size=self.alphabet_size,
            message_ticks=self.windows * self.ticks,
            channels=(Channel("robot", "robot", axes, self.windows, self.sigma),),
        )


def plant_cells(plant: str, job: PlantJob, rollouts: int, first_seed: int = FIRST_SEED) -> list[Cell]:
    """One cell for each message of a robot of that name."""
    given: dict[str, Scalar] = {"plant": plant, **asdict(job)}
    if plant.endswith(".toml"):
        # A file may change while its name stays.
        given["digest"] = hashlib.sha256(Path(plant).read_bytes()).hexdigest()[:16]
    return [Cell("plants", given, first_seed + number) for number in range(rollouts)]


def read_plant(parameters: Values, seed: int) -> dict[str, Scalar]:
    """How many of a message's symbols each detector has right, and the verdict of a decode that knows the onset."""
    name = str(parameters["plant"])
    job = PlantJob(
        int(parameters["alphabet_size"]), int(parameters["ticks"]), int(parameters["windows"]),
        float(parameters["sigma"]),
    )  # fmt: skip
    mover = vehicle(name)
    draw = np.random.default_rng([_STREAM, zlib.crc32(Path(name).name.encode()), seed])
    scheme = job.scheme(mover.kind.axes)
    key, robot = Key("plants", draw.bytes(32), scheme), mover.kind.draw(draw)
    symbols = tuple(int(symbol) for symbol in draw.integers(0, job.alphabet_size, job.windows))
    sending = Sending(
        codebook=key.codebook(), channel=scheme.channels[0], symbols=symbols, onset_s=ONSET_S, messages=1000,
        sigma=job.sigma,
    )  # fmt: skip
    message_s = scheme.message_ticks / scheme.rate_hz
    track = sent_track("robot", mover, [sending], ONSET_S + _LONGEST_MESSAGE * message_s + 0.1, draw, robot)
    once = _until(ONSET_S + message_s + _AFTER_S, track)
    motion = axis_motion(once, mover.kind.axes, scheme.band_hz[1], body=mover.kind.has_heading)
    genie = genie_scores(motion, sending, knowledge_of(mover, robot, sending, draw), job.windows)
    matched = _decoded(once, key, DecodeSettings(onset_s=ONSET_S))
    # Decoys do not change what the paper's detector scores; it wants some.
    coherency = _decoded(track, key, DecodeSettings(detector="coherency", onset_s=ONSET_S, decoys=2))
    return {
        "genie": int(np.sum(np.argmax(genie, axis=1) == symbols)),
        "matched": _right(matched, symbols),
        "coherency": _right(coherency, symbols),
        **_verdict(matched, symbols),
    }


def _decoded(track: Track, key: Key, settings: DecodeSettings) -> Decoding | None:
    """The decoding, or None where the track is refused."""
    try:
        return decode_tracks([track], key, settings)
    except MtmError:
        return None


def _right(decoding: Decoding | None, symbols: tuple[int, ...]) -> int:
    """How many of the first windows are decided right, each by itself."""
    if decoding is None or (reading := decoding.channels[0].reading) is None:
        return 0
    numbers, decided = reading.window_numbers, np.argmax(reading.window_scores, axis=1)
    first = (numbers >= 0) & (numbers < len(symbols))
    return int(np.sum(decided[first] == np.array(symbols)[numbers[first]]))


def _verdict(decoding: Decoding | None, symbols: tuple[int, ...]) -> dict[str, Scalar]:
    if decoding is None:
        return {"verdict": "refused", "wrong": False, "bits": 0.0}
    wrong = decoding.verdict == "decoded" and decoding.message != number_of_symbols(symbols, decoding.scheme)
    return {"verdict": decoding.verdict, "wrong": wrong, "bits": float(decoding.evidence.bits)}


def _until(end_s: float, track: Track) -> Track:
    count = int(np.searchsorted(track.times_s, end_s + 1e-6))
    headings = None if track.headings_rad is None else track.headings_rad[:count]
    return replace(
        track, times_s=track.times_s[:count], positions=track.positions[:count], valid=track.valid[:count],
        headings_rad=headings,
    )  # fmt: skip
