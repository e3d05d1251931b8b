"""The benchmark in sentences: the shortest window and the weakest noise that each detector needs."""

import math
from collections.abc import Sequence

import numpy as np

from hil.experiments.detectors.bench import DETECTORS, PAPER_SIGMA, Row
from hil.experiments.detectors.bench_recording import Job
from hil.experiments.detectors.bench_rollout import COHERENCY, GENIE, MATCHED
from mtm_audit.model.track import Floats


def summary(rows: Sequence[Row]) -> list[str]:
    """The sentences, one a line."""
    return [*_shortest_windows(rows), *_weakest_noises(rows)]


def _shortest_windows(rows: Sequence[Row]) -> list[str]:
    shortest = {name: shortest_window(rows, name, 99.0) for name in DETECTORS}
    lines = [
        f"paper's job, {name}: " + (f"T = {ticks}" if ticks else "no T measured") + " has 99 % of the messages whole"
        for name, ticks in shortest.items()
    ]
    for slow, quick in ((COHERENCY, MATCHED), (MATCHED, GENIE)):
        one, other = shortest[slow], shortest[quick]
        if one and other:
            lines.append(f"paper's job: {slow} takes {one / other:.2f} times the window of {quick}")
    return lines


def shortest_window(rows: Sequence[Row], detector: str, percent: float) -> int | None:
    """The smallest T measured with that share of whole messages in the paper's job; None when no T has it."""
    mine = [row for row in rows if row.detector == detector and row.job.windows == 1 and row.job.sigma == PAPER_SIGMA]
    return min((row.job.window_ticks for row in mine if row.messages.percent >= percent), default=None)


def _weakest_noises(rows: Sequence[Row]) -> list[str]:
    lines = []
    for job in dict.fromkeys(_without_sigma(row.job) for row in rows):
        alike = [row for row in rows if _without_sigma(row.job) == job]
        if len({row.job.sigma for row in alike}) < 2:
            continue
        alphabet_size, ticks, windows = job
        for percent in (99.0,) if windows == 1 else (97.0, 99.0):
            sigmas = {name: _sigma_of([row for row in alike if row.detector == name], percent) for name in DETECTORS}
            lines.append(_sigma_sentence(f"M = {alphabet_size}, T = {ticks}", windows == 1, percent, sigmas))
    return lines


def _without_sigma(job: Job) -> tuple[int, int, int]:
    return job.alphabet_size, job.window_ticks, job.windows


def _sigma_of(rows: Sequence[Row], percent: float) -> float:
    if len({row.job.sigma for row in rows}) < 2:
        return math.nan
    ordered = sorted(rows, key=lambda row: row.job.sigma)
    shares = [row.messages if row.job.windows == 1 else row.symbols for row in ordered]
    return crossing(
        np.array([row.job.sigma for row in ordered]), np.array([share.percent for share in shares]), percent
    )


def _sigma_sentence(name: str, messages: bool, percent: float, sigmas: dict[str, float]) -> str:
    what = "messages whole" if messages else "symbols right"
    found = ", ".join(f"{detector} {sigma:.4f}" for detector, sigma in sigmas.items() if math.isfinite(sigma))
    text = f"{name}, {percent:g} % of {what} at a sigma (m/s) of: {found or 'none measured'}"
    if math.isfinite(sigmas[MATCHED]) and math.isfinite(sigmas[GENIE]):
        text += f"; matched is {20.0 * math.log10(sigmas[MATCHED] / sigmas[GENIE]):.1f} dB from the genie"
    return text


def crossing(sigmas: Floats, percents: Floats, level: float) -> float:
    """The sigma at which accuracy, taken as increasing in sigma, reaches `level`; nan outside the range measured.

    `sigmas` ascending; the accuracies are made monotone by isotonic regression and interpolated over log sigma.
    """
    rising = isotonic(percents)
    above = np.flatnonzero(rising >= level)
    if not len(above) or above[0] == 0:
        return math.nan
    after = int(above[0])
    part = (level - rising[after - 1]) / (rising[after] - rising[after - 1])
    return float(sigmas[after - 1] * (sigmas[after] / sigmas[after - 1]) ** part)


def isotonic(values: Floats) -> Floats:
    """The non-decreasing sequence nearest to `values` in least squares (max-min formula of isotonic regression)."""
    count = len(values)
    means = np.array(
        [
            [values[first : last + 1].mean() if first <= last else np.inf for last in range(count)]
            for first in range(count)
        ]
    )
    return np.array(
        [max(means[first, place:].min() for first in range(place + 1)) for place in range(count)], dtype=np.float64
    )
