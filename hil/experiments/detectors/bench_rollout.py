"""One recording, read by the paper's detector, the matched one and the genie (the oracle, see genie.py)."""

from collections.abc import Sequence
from dataclasses import asdict, fields
from functools import lru_cache

import numpy as np

from hil.experiments.detectors.bench_recording import ONSET_S, Integers, Job, Recording, record, record_silence
from hil.experiments.detectors.genie import (
    Interference,
    expected_motion,
    fit_interference,
    log_likelihoods,
    responding_bins,
    tick_responses,
)
from hil.experiments.runs.cells import Scalar, Values
from hil.plants.mecanum import MecanumParameters
from hil.worlds.robomaster import fleet_scheme
from mtm_audit.detectors.coherency import rate_searched_scores
from mtm_audit.detectors.matched.estimate import estimate, fit_recording_noise
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.windows import make_window
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.timing import Timing
from mtm_onboard.protocol import Scheme

COHERENCY, MATCHED, GENIE = "coherency", "matched", "genie"
_SILENT_SEED = 2_000_000
_HIGHEST_HZ = fleet_scheme().band_hz[1]


def rollout_parameters(job: Job, plant: MecanumParameters, silences: int, *, coherency: bool) -> dict[str, Scalar]:
    """Parameters of a cell for `read_rollout`; the genie's interference is fitted to `silences` recordings."""
    return {**asdict(job), "silences": silences, "coherency": coherency, **asdict(plant)}


def read_rollout(parameters: Values, seed: int) -> dict[str, Scalar]:
    """The number of symbols that each detector has right in one rollout, by the detector's name."""
    job = job_of(parameters)
    plant = plant_of(parameters)
    recording = record(job, plant, seed)
    interference = learned_interference(job.end_s, plant, int(parameters["silences"]))
    decided = {MATCHED: read_matched(job, recording), GENIE: read_genie(job, plant, recording, interference)}
    if parameters["coherency"]:
        decided[COHERENCY] = read_coherency(job, recording)
    return {name: int(np.sum(symbols == recording.symbols)) for name, symbols in decided.items()}


def job_of(parameters: Values) -> Job:
    """The job that a cell's parameters describe."""
    return Job(
        int(parameters["alphabet_size"]), int(parameters["window_ticks"]), int(parameters["windows"]),
        float(parameters["sigma"]),
    )  # fmt: skip


def plant_of(parameters: Values) -> MecanumParameters:
    """The plant that a cell's parameters describe."""
    return MecanumParameters(**{field.name: float(parameters[field.name]) for field in fields(MecanumParameters)})


def read_coherency(job: Job, recording: Recording) -> Integers:
    """Symbols (robots, windows) by the paper's detector, one robot and one window at a time."""
    return np.array(
        [
            [
                int(np.argmax(rate_searched_scores(recording.codebook, channel, glimpse, ONSET_S, window)))
                for window in range(job.windows)
            ]
            for channel, glimpse in zip(job.scheme.channels, recording.longer, strict=True)
        ]
    )


def read_matched(job: Job, recording: Recording) -> Integers:
    """Symbols (robots, windows) by the matched detector, without knowing the plant, all robots jointly."""
    timing = Timing(ONSET_S, job.scheme.rate_hz)
    motions = _motions(recording.seen, job.scheme)
    windows = [
        make_window(recording.codebook, channel, motion, timing, robot, window, window)
        for robot, (channel, motion) in enumerate(zip(job.scheme.channels, motions, strict=True))
        for window in range(job.windows)
    ]
    found = estimate(windows, motions, fit_recording_noise(motions, [motion.velocities for motion in motions]))
    return np.array([int(np.argmax(ratios)) for ratios in found.ratios]).reshape(recording.symbols.shape)


def read_genie(job: Job, plant: MecanumParameters, recording: Recording, interference: Interference) -> Integers:
    """Symbols (robots, windows) by the genie, which is given every other window's symbol."""
    motions = _motions(recording.seen, job.scheme)
    ticks, rate_hz = job.window_ticks, job.scheme.rate_hz
    responses = [
        tick_responses(plant, ONSET_S + window * ticks / rate_hz, rate_hz, ticks, motions[0])
        for window in range(job.windows)
    ]
    decided = np.empty_like(recording.symbols)
    for robot, (channel, motion) in enumerate(zip(job.scheme.channels, motions, strict=True)):
        waveforms = recording.codebook.samples(channel, 0)
        played = waveforms[recording.symbols[robot]]
        added = [expected_motion(*pair, job.sigma) for pair in zip(responses, played, strict=True)]
        unexplained = motion.velocities - np.sum(added, axis=0)
        for window, response in enumerate(responses):
            bins = responding_bins(response)
            residual = (unexplained + added[window])[:, bins]
            candidates = expected_motion(response[bins], waveforms, job.sigma)
            decided[robot, window] = np.argmax(log_likelihoods(residual, candidates, interference))
    return decided


def _motions(glimpses: Sequence[Glimpse], scheme: Scheme) -> list[Motion]:
    return [uniform_motion(glimpse, scheme.band_hz[1]) for glimpse in glimpses]


def silent_motions(
    seconds: float, plant: MecanumParameters, silences: int, highest_hz: float = _HIGHEST_HZ
) -> list[Motion]:
    """Motions of that length without a message: all robots of `silences` recordings, on none of which is measured.

    Their time bins are those of motions that carry noise up to `highest_hz`.
    """
    recordings = [record_silence(seconds, plant, _SILENT_SEED + number) for number in range(silences)]
    return [uniform_motion(glimpse, highest_hz) for recording in recordings for glimpse in recording]


@lru_cache(maxsize=64)
def learned_interference(
    seconds: float, plant: MecanumParameters, silences: int, highest_hz: float = _HIGHEST_HZ
) -> Interference:
    """The interference that the genie is given for recordings of that length."""
    return fit_interference(silent_motions(seconds, plant, silences, highest_hz))
