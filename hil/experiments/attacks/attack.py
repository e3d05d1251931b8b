"""What an attack is to those who measure, tabulate and draw it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from hil.experiments.runs.cells import Scalar

TRIALS, RIGHT, MARGIN = "trials", "right", "margin"
"""What a measurement gives for each reader, under `<reader> <one of these>`; the margin may be missing."""
DISTORTION, DISTANCE, FORETOLD = "distortion", "distance", "foretold"
"""What it may give beside these: RMS change of the commands over their RMS, mean distance to the goal in metres, and
the share of the noise's variance that the attacker foretells (R2)."""

# Arm, level, rollouts and first seed to counts and means, as named above.
Measure = Callable[[str, float, int, int], Mapping[str, Scalar]]


@dataclass(frozen=True)
class PaperFigure:
    """What the paper reports, all but the margin in percent; `table` is its label."""

    table: str
    percent: float
    margin: float
    distortion_percent: float | None = None
    distance_percent: float | None = None


@dataclass(frozen=True, kw_only=True)
class Attack:
    """One attack: a curve for each arm, `levels` by arm, with `level` naming their axis and unit.

    `counted` says what is right or not in a trial, `chance_percent` how often that is so without a message. `share` of
    the rollouts that are asked for is measured, `batch` of them in one cell. `paper` has the paper's figures by arm and
    level.
    """

    name: str
    level: str
    counted: str
    levels: Mapping[str, tuple[float, ...]]
    measure: Measure
    chance_percent: float
    share: float = 0.2
    batch: int = 10
    paper: Mapping[tuple[str, float], PaperFigure] | None = None
