"""What a long recording taught about how a type of robot follows commands, kept for short ones.

The file holds nothing of the key, the message, the camera or the place: for each plant of the family its probability,
as TOML:

    format = 3
    plants = [
        {delay_s = 0.06, lag_s = 0.1, return_s = inf, notch_hz = inf, weight = 0.93},
        ...
    ]

(format 2 knew no notches, and is read as if none were likely) and, where it was measured, how each axis follows and
moves (`axis_response`), for plans.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mtm_audit.detectors.matched.axis_response import AxisResponse, axes_from_table, axes_text
from mtm_audit.detectors.matched.plants import FINE, Plants, without_notches
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, parsed_toml, read_text
from mtm_onboard.protocol.output_file import heading_of

PROFILE_FORMAT = 3
_WITHOUT_NOTCHES = 2
_NAMES = ("delay_s", "lag_s", "return_s", "notch_hz")
# How many robots have a notch filter in the way of the noise, before anything is known.
_NOTCHED = 0.1
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
    plants of each. Plants with a notch share a tenth.
    """
    notched = np.isfinite(plants.notches_hz)
    _, kinds, counts = np.unique(plants.returns_s[~notched], return_inverse=True, return_counts=True)
    prior = np.full(len(notched), _NOTCHED / max(1, int(notched.sum())))
    prior[~notched] = (1.0 - _NOTCHED if notched.any() else 1.0) / (len(counts) * counts[kinds])
    if profile is not None:
        known = FINE if notched.any() else without_notches(FINE)
        differences = np.sum((known.taps[:, None] - plants.taps[None]) ** 2, axis=2)
        prior *= 1.0 - _TRUST
        np.add.at(prior, np.argmin(differences, axis=1), _TRUST * profile.weights)
    return np.asarray(np.log(prior))


def profile_text(profile: PlantProfile) -> str:
    """The profile file's text; weights to their last bit, so that the file gives back what was learnt."""
    rows = []
    for plant, weight in zip(_parameters(), profile.weights, strict=True):
        named = [f"{name} = {value:.4g}" for name, value in zip(_NAMES, plant, strict=True)]
        rows.append(f"    {{{', '.join(named)}, weight = {float(weight)!r}}},")
    return "\n".join([f"format = {PROFILE_FORMAT}", "plants = [", *rows, "]"]) + "\n" + axes_text(profile.axes)


def save_profile(profile: PlantProfile, path: Path, command: str = "mtm-audit profile") -> None:
    """Write the profile file with the mark of `command`, whole or not at all; raises MtmError when it cannot be."""
    with replacing(path) as temporary:
        temporary.write_text(heading_of(command) + profile_text(profile), encoding="utf-8")


def load_profile(path: Path) -> PlantProfile:
    """Read a profile file; raises MtmError with one sentence that says what to change."""
    table = _read_toml(path)
    version = table.get("format")
    if version not in (PROFILE_FORMAT, _WITHOUT_NOTCHES):
        raise MtmError(
            f"{path} is of profile format {version!r}, this program reads {_WITHOUT_NOTCHES} and {PROFILE_FORMAT}; "
            "make it anew with mtm-audit profile"
        )
    unknown = sorted(table.keys() - {"format", "plants", "axes"})
    if unknown:
        raise MtmError(f"{path} has an unknown field {unknown[0]!r}; remove it or correct its spelling")
    rows = table.get("plants")
    listed = np.flatnonzero((version == PROFILE_FORMAT) | np.isinf(FINE.notches_hz))
    if not isinstance(rows, list) or len(rows) != len(listed):
        raise MtmError(f"{path} does not list the {len(listed)} plants of this program; make it anew with "
                       "mtm-audit profile")  # fmt: skip
    names = _NAMES if version == PROFILE_FORMAT else _NAMES[:-1]
    weights, parameters = np.zeros(len(FINE.taps)), _parameters()
    for number, plant in enumerate(listed.tolist()):
        weights[plant] = _weight(path, rows[number], number, dict(zip(names, parameters[plant], strict=False)))
    if abs(weights.sum() - 1.0) > 0.01:
        raise MtmError(f"{path}: the weights add up to {weights.sum():.3g} and not to 1; make it anew with "
                       "mtm-audit profile")  # fmt: skip
    axes = axes_from_table(table["axes"], str(path)) if "axes" in table else ()
    return PlantProfile(weights / weights.sum(), axes)


def _parameters() -> list[list[float]]:
    """What tells each plant of the family from the others, in the order of the names."""
    columns = (FINE.delays_s.tolist(), FINE.lags_s.tolist(), FINE.returns_s.tolist(), FINE.notches_hz.tolist())
    return [list(row) for row in zip(*columns, strict=True)]


def _weight(path: Path, row: Any, number: int, expected: Mapping[str, float]) -> float:
    """The weight in one row, which must be that of the plant with the `expected` parameters."""
    fields = (*expected, "weight")
    if not isinstance(row, dict) or set(row) != set(fields):
        raise MtmError(f"{path}: plant {number + 1} must have {', '.join(fields)} and nothing else; make it anew")
    if not all(isinstance(row[name], int | float) and not isinstance(row[name], bool) for name in fields):
        raise MtmError(f"{path}: plant {number + 1} holds something that is not a number; make it anew")
    if not all(math.isclose(row[name], value, abs_tol=1e-4) for name, value in expected.items()):
        raise MtmError(f"{path}: plant {number + 1} is none of this program's; make it anew with mtm-audit profile")
    weight = float(row["weight"])
    if not 0.0 <= weight <= 1.0:
        raise MtmError(f"{path}: the weight of plant {number + 1} is {weight} and must lie in 0 to 1; make it anew")
    return weight


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return parsed_toml(read_text(path, "the profile"))
    except BrokenTextError as error:
        raise MtmError(f"{path} is no profile; name a file that mtm-audit profile wrote") from error
