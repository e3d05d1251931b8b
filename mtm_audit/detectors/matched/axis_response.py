"""How an axis of a robot follows, and how it moves without a message: what a plan needs to shape the noise.

In a profile file, one line a frequency, with the gain and the one-sided power density of the motion:

    [axes]
    vx = [
        [0.5, 0.73, 4.1e-5],
        ...
    ]
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mtm_audit.model.track import Floats
from mtm_onboard.protocol.errors import MtmError

_FEWEST_ROWS = 2


@dataclass(frozen=True)
class AxisResponse:
    """One axis, `vx` for instance: `rows` of frequency in Hz, gain, and density in (m/s)^2/Hz or (rad/s)^2/Hz."""

    name: str
    rows: tuple[tuple[float, float, float], ...]

    def at(self, frequencies_hz: Floats) -> tuple[Floats, Floats]:
        """Gains and densities, shape as the input, by lines through their logarithms; the nearest beyond the rows."""
        known_hz, gains, densities = np.array(self.rows).T
        return (
            np.exp(np.interp(frequencies_hz, known_hz, np.log(gains))),
            np.exp(np.interp(frequencies_hz, known_hz, np.log(densities))),
        )


def axes_text(axes: Sequence[AxisResponse]) -> str:
    """The table `[axes]` of a profile file; nothing where no axis was measured."""
    if not axes:
        return ""
    lines = ["[axes]"]
    for axis in axes:
        lines += [f"{axis.name} = ["]
        lines += [f"    [{hz:.4g}, {gain:.4g}, {density:.4g}]," for hz, gain, density in axis.rows]
        lines += ["]"]
    return "\n".join(lines) + "\n"


def axes_from_table(table: object, where: str) -> tuple[AxisResponse, ...]:
    """The axes of a parsed profile; raises MtmError, which begins with `where`, for what is none."""
    if not isinstance(table, dict):
        raise MtmError(f"{where}: axes must be a table ([axes]); make the profile anew with mtm-hil identify")
    return tuple(AxisResponse(name, _rows(rows, name, where)) for name, rows in table.items())


def _rows(rows: Any, name: str, where: str) -> tuple[tuple[float, float, float], ...]:
    if not isinstance(rows, list) or len(rows) < _FEWEST_ROWS or not all(_is_row(row) for row in rows):
        raise MtmError(
            f"{where}: axis {name!r} must list two or more rows of three numbers above zero, [Hz, gain, density]; make "
            "the profile anew with mtm-hil identify"
        )
    found = tuple((float(row[0]), float(row[1]), float(row[2])) for row in rows)
    if any(later[0] <= earlier[0] for earlier, later in pairwise(found)):
        raise MtmError(f"{where}: the frequencies of axis {name!r} must rise from row to row; make the profile anew")
    return found


def _is_row(row: Any) -> bool:
    return (
        isinstance(row, list)
        and len(row) == 3
        and all(isinstance(value, int | float) and not isinstance(value, bool) for value in row)
        and all(math.isfinite(value) and value > 0.0 for value in row)
    )
