"""Plant files: robots that were identified, as TOML, for `--plant FILE` and for the family.

    format = 1
    summary = "iRobot Create, identified"
    source = "where the logs come from"

    [[robots]]
    source = "one of the logs"
    [robots.vx]
    gain = 0.8
    delay_s = 0.13
    lag_s = 0.16                       # a first-order lag, or else
    natural_hz = 1.5                   # an oscillator with its
    damping = 0.7                      # damping ratio
    deviation = 0.017                  # interference: standard deviation in m/s or rad/s
    correlation_s = 0.02               # and the time in which it is forgotten

Each robot has a table for each axis that it follows, `vx`, `vy` or `wz`, and all have the same axes.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hil.plants.interference import Interference, Slip, Sum
from hil.plants.linear_response import LinearResponse
from hil.plants.responses import Gain, PerAxis, Response
from hil.plants.robots import Robot
from mtm_onboard.model.velocity import AXES
from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, parsed_toml, read_text

PLANT_FORMAT = 1
# Least and most of each number of an axis, and whether it must be there.
_NUMBERS = {
    "gain": (1e-6, 100.0, True), "delay_s": (0.0, 10.0, True), "lag_s": (0.0, 100.0, False),
    "natural_hz": (0.01, 50.0, False), "damping": (0.01, 10.0, False), "deviation": (0.0, 100.0, True),
    "correlation_s": (1e-4, 1e4, True),
}  # fmt: skip


@dataclass(frozen=True)
class IdentifiedAxis:
    """How one axis follows, and its interference: standard deviation in m/s or rad/s, correlation time in s."""

    response: LinearResponse
    deviation: float
    correlation_s: float


@dataclass(frozen=True)
class IdentifiedRobot:
    """One robot, from the log that `source` names: its `axes` by name."""

    source: str
    axes: Mapping[str, IdentifiedAxis]

    def robot(self) -> Robot:
        """The simulated robot; axes that were not identified do not follow and are still."""

        def respond(step_s: float) -> Response:
            return PerAxis(
                [self.axes[axis].response.respond(step_s) if axis in self.axes else Gain(0.0) for axis in AXES]
            )

        def disturb(step_s: float, draw: np.random.Generator) -> Interference:
            alone = np.eye(len(AXES))
            return Sum(*(
                Slip(step_s, own.deviation * alone[AXES.index(axis)], own.correlation_s, draw)
                for axis, own in self.axes.items()
            ))  # fmt: skip

        return Robot(respond, disturb)


@dataclass(frozen=True)
class IdentifiedPlant:
    """Robots of one kind, all with the same axes."""

    summary: str
    source: str
    robots: tuple[IdentifiedRobot, ...]

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes that the robots follow, in the order vx, vy, wz."""
        return tuple(axis for axis in AXES if axis in self.robots[0].axes)

    def draw(self, draw: np.random.Generator) -> Robot:
        """One of the robots, each as likely as the others."""
        return self.robots[int(draw.integers(len(self.robots)))].robot()


def save_plant(plant: IdentifiedPlant, path: Path, comments: Sequence[str] = ()) -> None:
    """Write the plant file under its comments, whole or not at all; raises MtmError when it cannot be written."""
    lines = [*(f"# {comment}" for comment in comments), f"format = {PLANT_FORMAT}"]
    lines += [f"summary = {_quoted(plant.summary)}", f"source = {_quoted(plant.source)}"]
    for robot in plant.robots:
        lines += ["", "[[robots]]", f"source = {_quoted(robot.source)}"]
        for axis, own in robot.axes.items():
            response = own.response
            follows = {"gain": response.gain, "delay_s": response.delay_s}
            follows |= {"lag_s": response.lag_s} if response.lag_s > 0.0 else {}
            if response.natural_hz is not None:
                follows |= {"natural_hz": response.natural_hz, "damping": response.damping}
            values = {**follows, "deviation": own.deviation, "correlation_s": own.correlation_s}
            lines += [f"[robots.{axis}]", *(f"{name} = {float(f'{value:.4g}')!r}" for name, value in values.items())]
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _quoted(text: str) -> str:
    # JSON's escapes are TOML's as well, but JSON leaves one control character as it is.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def load_plant(path: Path) -> IdentifiedPlant:
    """Read a plant file; raises MtmError with one sentence that says what to change."""
    try:
        table = parsed_toml(read_text(path, "the plant"))
    except BrokenTextError as error:
        raise MtmError(f"{path} is no plant file; name one that mtm-hil identify wrote") from error
    if table.get("format") != PLANT_FORMAT:
        raise MtmError(
            f"{path} is of plant format {table.get('format')!r}, this program reads {PLANT_FORMAT}; make it anew with "
            "mtm-hil identify"
        )
    _only(path, table, {"format", "summary", "source", "robots"}, "the file")
    rows = table.get("robots")
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise MtmError(f"{path} has no robots; give it a [[robots]] table for each")
    robots = tuple(_robot(path, row, number) for number, row in enumerate(rows, 1))
    if len({frozenset(robot.axes) for robot in robots}) > 1:
        raise MtmError(f"{path}: the robots differ in their axes; put each kind into a file of its own")
    return IdentifiedPlant(_text(path, table, "summary"), _text(path, table, "source"), robots)


def _robot(path: Path, row: Mapping[str, Any], number: int) -> IdentifiedRobot:
    what = f"robot {number}"
    _only(path, row, {"source", *AXES}, what)
    axes = {axis: _axis(path, row[axis], f"{what}, {axis}") for axis in AXES if axis in row}
    if not axes:
        raise MtmError(f"{path}: {what} follows no axis; give it a table for each of vx, vy and wz that it follows")
    return IdentifiedRobot(_text(path, row, "source"), axes)


def _axis(path: Path, row: Any, what: str) -> IdentifiedAxis:
    if not isinstance(row, dict):
        raise MtmError(f"{path}: {what} is not a table; see docs/plants.md for its fields")
    _only(path, row, set(_NUMBERS), what)
    values = {name: _number(path, row[name], name, what) for name in _NUMBERS if name in row}
    missing = [name for name, (_, _, needed) in _NUMBERS.items() if needed and name not in values]
    if missing:
        raise MtmError(f"{path}: {what} lacks {missing[0]}; add it")
    if ("natural_hz" in values) != ("damping" in values):
        raise MtmError(f"{path}: {what} has one of natural_hz and damping; an oscillator has both")
    deviation, correlation_s = values.pop("deviation"), values.pop("correlation_s")
    return IdentifiedAxis(LinearResponse(**values), deviation, correlation_s)


def _number(path: Path, value: object, name: str, what: str) -> float:
    least, most, _ = _NUMBERS[name]
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not (math.isfinite(value) and least <= value <= most):  # type: ignore[arg-type, operator]
        raise MtmError(f"{path}: {name} of {what} is {value!r} and must be a number from {least:g} to {most:g}")
    return float(value)  # type: ignore[arg-type]


def _text(path: Path, table: Mapping[str, Any], name: str) -> str:
    value = table.get(name, "")
    if not isinstance(value, str):
        raise MtmError(f"{path}: {name} is {value!r} and must be a text")
    return value


def _only(path: Path, table: Mapping[str, Any], known: set[str], what: str) -> None:
    unknown = sorted(table.keys() - known)
    if unknown:
        raise MtmError(f"{path}: {what} has an unknown field {unknown[0]!r}; remove it or correct its spelling")
