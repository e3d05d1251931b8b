"""What the noise's spectrum is worth: a large alphabet in short windows.

Flat in the usual band, flat in a wide one, and water-filled there for the calibrated plant and what disturbs it in its
task.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache

import numpy as np
from rich.console import Console

from hil.experiments.detectors.bench_recording import Job, record
from hil.experiments.detectors.bench_rollout import (
    GENIE,
    MATCHED,
    learned_interference,
    plant_of,
    read_genie,
    read_matched,
    silent_motions,
)
from hil.experiments.detectors.capacity import signal_to_interference
from hil.experiments.runs.cells import Cell, CellStore, Scalar, Values
from hil.experiments.runs.proportion import Proportion
from hil.experiments.runs.sweep import run_sweep
from hil.plants.mecanum import MecanumParameters, calibrated_parameters
from hil.worlds.robomaster import ROBOTS
from mtm_audit.model.track import Floats
from mtm_audit.planning.waterfill import capacity_bps, spectrum_points, water_filled
from mtm_onboard.protocol import Scheme
from mtm_onboard.protocol.spectrum import Points, tone_powers

USUAL, WIDE, FILLED = "0.5-5 Hz, flat", "0.3-8 Hz, flat", "0.3-8 Hz, water-filled"
BANDS_HZ = {USUAL: (0.5, 5.0), WIDE: (0.3, 8.0), FILLED: (0.3, 8.0)}
DETECTORS = (MATCHED, GENIE)
FIRST_SEED = 950_000

_ALPHABET_SIZE, _WINDOW_TICKS, _WINDOWS, _SIGMA_MPS = 4096, 100, 4, 0.1
_SILENCES, _SILENT_S = 10, 17.5
_POINTS = 8


@dataclass(frozen=True)
class ShapedJob(Job):
    """A job whose noise has one of the three spectra."""

    shape: str

    @property
    def scheme(self) -> Scheme:
        """The job's scheme with the band and the spectrum of its shape."""
        spectrum = filled_points(calibrated_parameters()) if self.shape == FILLED else None
        return replace(super().scheme, band_hz=BANDS_HZ[self.shape], spectrum=spectrum)


@dataclass(frozen=True)
class SpectrumRow:
    """One shape: symbols right by detector, and the channel's capacity under it, bits/s a robot."""

    shape: str
    symbols: dict[str, Proportion]
    capacity_bps: float


def spectra_rows(
    rollouts: int, first_seed: int, store: CellStore, console: Console, workers: int | None = None
) -> list[SpectrumRow]:
    """Measure all shapes on the same seeds."""
    plant, rows = calibrated_parameters(), []
    for shape in BANDS_HZ:
        job = ShapedJob(_ALPHABET_SIZE, _WINDOW_TICKS, _WINDOWS, _SIGMA_MPS, shape)
        given: dict[str, Scalar] = {**asdict(job), **asdict(plant)}
        cells = [Cell("spectra", given, first_seed + number) for number in range(rollouts)]
        results = run_sweep(read_shaped, cells, store, console, workers)
        trials = ROBOTS * _WINDOWS * rollouts
        symbols = {name: Proportion(sum(int(one[name]) for one in results), trials) for name in DETECTORS}
        rows.append(SpectrumRow(shape, symbols, _capacity_bps(shape, plant)))
    return rows


def read_shaped(parameters: Values, seed: int) -> dict[str, Scalar]:
    """How many symbols each detector has right in one rollout; the onset is known, as in the benchmark."""
    job = ShapedJob(
        int(parameters["alphabet_size"]), int(parameters["window_ticks"]), int(parameters["windows"]),
        float(parameters["sigma"]), str(parameters["shape"]),
    )  # fmt: skip
    plant = plant_of(parameters)
    recording = record(job, plant, seed)
    interference = learned_interference(job.end_s, plant, _SILENCES, job.scheme.band_hz[1])
    decided = {MATCHED: read_matched(job, recording), GENIE: read_genie(job, plant, recording, interference)}
    return {name: int(np.sum(symbols == recording.symbols)) for name, symbols in decided.items()}


def filled_points(plant: MecanumParameters, count: int = _POINTS) -> Points:
    """The water-filled spectrum of the wide band as so many points."""
    frequencies_hz, ratios = _ratios(plant, BANDS_HZ[FILLED])
    return spectrum_points(frequencies_hz, water_filled(ratios), count)


def _capacity_bps(shape: str, plant: MecanumParameters) -> float:
    low_hz, high_hz = BANDS_HZ[shape]
    frequencies_hz, ratios = _ratios(plant, (low_hz, high_hz))
    powers = np.ones(len(frequencies_hz))
    if shape == FILLED:
        powers = tone_powers(filled_points(plant), frequencies_hz.astype(np.float64))
    return capacity_bps(ratios, powers, high_hz - low_hz)


@lru_cache(maxsize=8)
def _ratios(plant: MecanumParameters, band_hz: tuple[float, float]) -> tuple[Floats, Floats]:
    silences = silent_motions(_SILENT_S, plant, _SILENCES, band_hz[1])
    return signal_to_interference(plant, _SIGMA_MPS, 50.0, band_hz, silences)


def told(rows: Sequence[SpectrumRow]) -> list[str]:
    """A sentence for each shape."""
    return [
        f"{row.shape}: capacity {row.capacity_bps:.1f} bits/s; "
        + ", ".join(f"{name} {row.symbols[name]} %" for name in DETECTORS)
        for row in rows
    ]
