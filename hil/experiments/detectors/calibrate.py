"""Fitting the plant's slip to the paper's margins on hardware (tab:robomaster-indep), with the paper's own detector.

All other parameters of the plant are set by hand. The margin is the finer measure: the accuracy is 100 % at most window
lengths.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from rich.console import Console

from hil.experiments.detectors.paper_figures import MARGINS
from hil.experiments.detectors.robomaster_rollout import SENT, decode_rollout, rollout_parameters
from hil.experiments.runs.cells import Cell, CellStore
from hil.experiments.runs.sweep import run_sweep
from hil.plants.mecanum import MecanumParameters
from mtm_onboard.protocol.atomicfile import replacing

# Far from the seeds of the tables, which count from 0: what is fitted on must not be what is reported.
FIRST_SEED = 1_000_000
SLIPS_MPS = tuple(round(0.035 + 0.0025 * step, 4) for step in range(11))


@dataclass(frozen=True)
class Candidate:
    """One slip and what it gave at each T: mean margin and symbol accuracy (0 to 1)."""

    slip_mps: float
    margins: Mapping[int, float]
    accuracies: Mapping[int, float]

    @property
    def ratios(self) -> dict[int, float]:
        """Margin over the paper's, at each T."""
        return {ticks: margin / MARGINS[ticks] for ticks, margin in self.margins.items()}

    @property
    def misfit(self) -> float:
        """Sum of squared logarithms of the ratios; infinite when a margin is not above zero."""
        if min(self.margins.values()) <= 0.0:
            return math.inf
        return sum(math.log(ratio) ** 2 for ratio in self.ratios.values())


def scan(
    plant: MecanumParameters,
    slips_mps: Sequence[float],
    rollouts: int,
    store: CellStore,
    console: Console,
    *,
    message_ticks: Sequence[int] = tuple(MARGINS),
    workers: int | None = None,
) -> list[Candidate]:
    """The candidates in the order of `slips_mps`, each run on the same seeds."""
    cells = {
        (slip, ticks): [_cell(replace(plant, slip_mps=slip), ticks, FIRST_SEED + number) for number in range(rollouts)]
        for slip in slips_mps
        for ticks in message_ticks
    }
    flat = [cell for group in cells.values() for cell in group]
    results = dict(
        zip((cell.name for cell in flat), run_sweep(decode_rollout, flat, store, console, workers), strict=True)
    )

    def mean(slip: float, ticks: int, name: str) -> float:
        return float(np.mean([float(results[cell.name][name]) for cell in cells[slip, ticks]]))

    return [
        Candidate(
            slip,
            {ticks: mean(slip, ticks, "margin") for ticks in message_ticks},
            {ticks: mean(slip, ticks, "correct") / mean(slip, ticks, "decodes") for ticks in message_ticks},
        )
        for slip in slips_mps
    ]


def best_candidate(candidates: Sequence[Candidate]) -> Candidate:
    """The one with the smallest misfit."""
    return min(candidates, key=lambda candidate: candidate.misfit)


def write_plant(path: Path, plant: MecanumParameters, candidate: Candidate, command: str) -> None:
    """Write the calibrated plant, with a header that says which command made it and what it attained."""
    lines = [
        f"# {command}",
        "# slip_mps is fitted to the paper's RoboMaster margins; everything else is set by hand.",
        f"# Sum of squared log ratios of the margins to the paper's: {candidate.misfit:.4f}",
    ]
    lines += [
        f"# T = {ticks:4d}: margin {candidate.margins[ticks]:.3f}, paper {MARGINS[ticks]:.3f}, ratio {ratio:.2f}, "
        f"symbols {100 * candidate.accuracies[ticks]:.1f} %"
        for ticks, ratio in candidate.ratios.items()
    ]
    fitted = replace(plant, slip_mps=candidate.slip_mps)
    lines += ["[plant]", *(f"{field.name} = {getattr(fitted, field.name)!r}" for field in fields(fitted))]
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _cell(plant: MecanumParameters, ticks: int, seed: int) -> Cell:
    return Cell("robomaster", rollout_parameters(SENT, ticks, plant), seed)
