"""What a long recording taught about how a type of robot follows commands, kept for short ones.

The file holds nothing of the key, the message, the camera or the place: for each plant of the family its probability,
as TOML:

    format = 2
    plants = [
        {delay_s = 0.06, lag_s = 0.1, return_s = inf, weight = 0.93},
        ...
    ]

and, where it was measured, how each axis follows and moves (`axis_response`), for plans.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mtm_audit.detectors.matched.axis_response import AxisResponse, axes_from_table, axes_text
from mtm_audit.detectors.matched.plants import FINE, Plants
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, parsed_toml, read_text
from mtm_onboard.protocol.output_file import heading_of

PROFILE_FORMAT = 2
# The next robot of the type is another one, with another load on another floor.
_TRUST = 0.9


@dataclass(frozen=True)
class PlantProfile:
    """Probabilities of the plants of the family `FINE`: `weights` (plants,), of sum 1; `axes` that were measured."""

    weights: Floats
    axes: tuple[AxisResponse, ...] = ()


def log_prior(profile: PlantProfile | None, plants: Plants) -> Floats:
    """Log prior of each of `plants`: what is known counts for its nearest and rules none out.

    Else each time constant of returning, none at all being one of them, is as likely as the others, and so are the
    plants of each.
    """
    _, kinds, counts = np.unique(plants.returns_s, return_inverse=True, return_counts=True)
    prior = 1.0 / (len(counts) * counts[kinds])
    if profile is not None:
        differences = np.sum((FINE.taps[:, None] - plants.taps[None]) ** 2, axis=2)
        prior *= 1.0 - _TRUST
        np.add.at(prior, np.argmin(differences, axis=1), _TRUST * profile.weights)
    return np.asarray(np.log(prior))


def profile_text(profile: PlantProfile) -> str:
    """The profile file's text; weights to their last bit, so that the file gives back what was learnt."""
    rows = [
        f"    {{delay_s = {delay_s:.4g}, lag_s = {lag_s:.4g}, return_s = {return_s:.4g}, weight = {float(weight)!r}}},"
        for delay_s, lag_s, return_s, weight in zip(
            FINE.delays_s, FINE.lags_s, FINE.returns_s, profile.weights, strict=True
        )
    ]
    return "\n".join([f"format = {PROFILE_FORMAT}", "plants = [", *rows, "]"]) + "\n" + axes_text(profile.axes)


def save_profile(profile: PlantProfile, path: Path, command: str = "mtm-audit profile") -> None:
    """Write the profile file with the mark of `command`, whole or not at all; raises MtmError when it cannot be."""
    with replacing(path) as temporary:
        temporary.write_text(heading_of(command) + profile_text(profile), encoding="utf-8")


def load_profile(path: Path) -> PlantProfile:
    """Read a profile file; raises MtmError with one sentence that says what to change."""
    table = _read_toml(path)
    if table.get("format") != PROFILE_FORMAT:
        raise MtmError(
            f"{path} is of profile format {table.get('format')!r}, this program reads {PROFILE_FORMAT}; make it anew "
            "with mtm-audit profile"
        )
    unknown = sorted(table.keys() - {"format", "plants", "axes"})
    if unknown:
        raise MtmError(f"{path} has an unknown field {unknown[0]!r}; remove it or correct its spelling")
    rows = table.get("plants")
    if not isinstance(rows, list) or len(rows) != len(FINE.taps):
        raise MtmError(f"{path} does not list the {len(FINE.taps)} plants of this program; make it anew with "
                       "mtm-audit profile")  # fmt: skip
    weights = np.array([_weight(path, row, number) for number, row in enumerate(rows)])
    if abs(weights.sum() - 1.0) > 0.01:
        raise MtmError(f"{path}: the weights add up to {weights.sum():.3g} and not to 1; make it anew with "
                       "mtm-audit profile")  # fmt: skip
    axes = axes_from_table(table["axes"], str(path)) if "axes" in table else ()
    return PlantProfile(weights / weights.sum(), axes)


def _weight(path: Path, row: Any, number: int) -> float:
    """The weight in one row, which must be that of the family's plant of the same number."""
    fields = ("delay_s", "lag_s", "return_s", "weight")
    if not isinstance(row, dict) or set(row) != set(fields):
        raise MtmError(f"{path}: plant {number + 1} must have {', '.join(fields)} and nothing else; make it anew")
    values = [row[name] for name in fields]
    if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        raise MtmError(f"{path}: plant {number + 1} holds something that is not a number; make it anew")
    expected = [float(own[number]) for own in (FINE.delays_s, FINE.lags_s, FINE.returns_s)]
    if not all(math.isclose(value, other, abs_tol=1e-4) for value, other in zip(values[:3], expected, strict=True)):
        raise MtmError(f"{path}: plant {number + 1} is none of this program's; make it anew with mtm-audit profile")
    if not 0.0 <= values[3] <= 1.0:
        raise MtmError(f"{path}: the weight of plant {number + 1} is {values[3]} and must lie in 0 to 1; make it anew")
    return float(values[3])


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return parsed_toml(read_text(path, "the profile"))
    except BrokenTextError as error:
        raise MtmError(f"{path} is no profile; name a file that mtm-audit profile wrote") from error
