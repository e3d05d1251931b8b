"""The family of simulated robots: kinds that differ in how they follow commands and in what disturbs them.

A robot of a kind is drawn: each of its parameters is uniform in the range that stands here and in docs/plants.md.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hil.plants.arm import Arm
from hil.plants.interference import Gait, Interference, Slip, Sum
from hil.plants.mecanum import MecanumParameters, MecanumPlant, calibrated_parameters
from hil.plants.plant_file import IdentifiedPlant, load_plant
from hil.plants.responses import (
    Chain,
    Delay,
    Floats,
    Friction,
    Response,
    Saturation,
    SlewLimit,
    lag,
    notch,
    oscillator,
)
from hil.plants.robots import Robot
from mtm_onboard.model.velocity import BodyVelocity

Draw = np.random.Generator


@dataclass(frozen=True)
class PlantKind:
    """`summary` in a line, `axes` that carry a message's noise, and how a robot of the kind is drawn.

    An arm's tool has no heading; everything else does. `turns` where a demand of yaw rate is followed by itself as
    well, which is a third axis for a message though robots of the kind are measured without it.
    """

    summary: str
    axes: tuple[str, ...]
    draw: Callable[[Draw], Robot]
    has_heading: bool = True
    turns: bool = False

    @property
    def follows(self) -> tuple[str, ...]:
        """The axes on which noise moves such a robot: its own, and the yaw rate of one that turns by itself."""
        return tuple(dict.fromkeys([*self.axes, *(("wz",) if self.turns else ())]))


def _robomaster(_draw: Draw) -> Robot:
    parameters = calibrated_parameters()
    slips = (parameters.slip_mps, parameters.slip_mps, parameters.yaw_slip_radps)
    return Robot(
        lambda step_s: _Mecanum(replace(parameters, slip_mps=0.0, yaw_slip_radps=0.0, step_s=step_s)),
        lambda step_s, draw: Slip(step_s, slips, parameters.slip_correlation_s, draw),
    )


class _Mecanum:
    """The calibrated chassis without its slip, which is interference here."""

    def __init__(self, parameters: MecanumParameters) -> None:
        self._plant, self._step_s, self._steps = MecanumPlant(parameters, 0), parameters.step_s, 0

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        followed = np.empty_like(demand)
        for row, velocity in enumerate(demand.tolist()):
            self._plant.command(self._steps * self._step_s, BodyVelocity(*velocity))
            self._steps += 1
            self._plant.step(self._steps * self._step_s)
            followed[row] = self._plant.velocity_body
        return followed


def _differential(draw: Draw) -> Robot:
    ground = _on_the_ground(draw, _first_order(draw))
    return Robot(lambda step_s: Chain(_NoSideways(), ground.respond(step_s)), ground.disturb)


class _NoSideways:
    """Wheels that roll ahead do not follow a sideways demand."""

    def advance(self, demand: Floats) -> Floats:
        """What becomes of the demand of the next steps."""
        return np.asarray(demand * np.array([1.0, 0.0, 1.0]))


def _holonomic(draw: Draw) -> Robot:
    return _on_the_ground(draw, _first_order(draw))


def _heavy(draw: Draw) -> Robot:
    slew = _uniform(draw, 0.2, 0.5)
    return _on_the_ground(draw, lambda step_s: Chain(lag(step_s, 0.8), SlewLimit(step_s, slew)))


def _legged(draw: Draw) -> Robot:
    ground = _on_the_ground(draw, _first_order(draw))
    stride_hz, sway_mps = _uniform(draw, 0.8, 2.5), _uniform(draw, 0.05, 0.2)
    return Robot(
        ground.respond,
        lambda step_s, own: Sum(ground.disturb(step_s, own), Gait(step_s, stride_hz, sway_mps, own)),
    )


def _quadrotor(draw: Draw) -> Robot:
    delay_s, natural_hz, damping = _uniform(draw, 0.02, 0.1), _uniform(draw, 0.5, 1.5), _uniform(draw, 0.3, 0.9)
    gust_mps, gust_s = _uniform(draw, 0.02, 0.08), _uniform(draw, 0.3, 1.0)
    return Robot(
        lambda step_s: Chain(Delay(step_s, delay_s), oscillator(step_s, natural_hz, damping)),
        lambda step_s, own: Slip(step_s, (gust_mps, gust_mps, 0.02), gust_s, own),
    )


def _arm(draw: Draw) -> Robot:
    delay_s, lag_s, play_rad = _uniform(draw, 0.02, 0.1), _uniform(draw, 0.08, 0.25), _uniform(draw, 0.004, 0.04)
    ripple_mps, ripple_s = _uniform(draw, 0.002, 0.01), _uniform(draw, 0.02, 0.1)
    return Robot(
        lambda step_s: Chain(Delay(step_s, delay_s), Arm(step_s, lag_s, play_rad)),
        lambda step_s, own: Slip(step_s, (ripple_mps, ripple_mps, 0.0), ripple_s, own),
    )


def _sticking(draw: Draw) -> Robot:
    follow, least = _first_order(draw), _uniform(draw, 0.03, 0.12)
    return _on_the_ground(draw, lambda step_s: Chain(follow(step_s), Friction(least)))


def _bent(draw: Draw) -> Robot:
    limit = _uniform(draw, 0.1, 0.4)
    return _on_the_ground(draw, lambda step_s: Chain(Saturation(limit), lag(step_s, 0.12)))


def _notched(draw: Draw) -> Robot:
    follow, notch_hz, quality = _first_order(draw), _uniform(draw, 1.0, 4.0), _uniform(draw, 0.5, 2.0)
    return _on_the_ground(draw, lambda step_s: Chain(notch(step_s, notch_hz, quality), follow(step_s)))


def _on_the_ground(draw: Draw, respond: Callable[[float], Response]) -> Robot:
    """What `respond` makes of the demand after a delay, on wheels that slip."""
    delay_s, slip_mps, slip_s = _uniform(draw, 0.02, 0.1), _uniform(draw, 0.01, 0.05), _uniform(draw, 0.05, 0.3)

    def disturb(step_s: float, own: Draw) -> Interference:
        return Slip(step_s, (slip_mps, slip_mps, slip_mps), slip_s, own)

    return Robot(lambda step_s: Chain(Delay(step_s, delay_s), respond(step_s)), disturb)


def _first_order(draw: Draw) -> Callable[[float], Response]:
    lag_s = _uniform(draw, 0.08, 0.25)
    return lambda step_s: lag(step_s, lag_s)


def _uniform(draw: Draw, low: float, high: float) -> float:
    return float(draw.uniform(low, high))


def kind_of(plant: IdentifiedPlant) -> PlantKind:
    """Robots that were identified, as a kind."""
    return PlantKind(plant.summary, plant.axes, plant.draw)


_WORLD = ("vx", "vy")
ROBOMASTER = "robomaster"
# Identified from logs of ten real robots.
CREATE_FILE = Path(__file__).with_name("create_plant.toml")

PLANTS: dict[str, PlantKind] = {
    ROBOMASTER: PlantKind("mecanum wheels, calibrated to the paper's hardware", _WORLD, _robomaster, turns=True),
    "diff-drive": PlantKind("two driven wheels; ahead and turn rate carry the noise", ("vx", "wz"), _differential),
    "spinning": PlantKind("omnidirectional wheels, turning at 1 rad/s all the time", _WORLD, _holonomic),
    "heavy": PlantKind("lag of 0.8 s and a slew limit", _WORLD, _heavy),
    "legged": PlantKind("walks, with its gait in the band", _WORLD, _legged),
    "quadrotor": PlantKind("an oscillator of 0.5 to 1.5 Hz in gusts", _WORLD, _quadrotor),
    "arm": PlantKind("the tool of a two-link arm with play in its gears", _WORLD, _arm, has_heading=False),
    "stop-and-go": PlantKind("stands half of the time, held by friction", _WORLD, _sticking),
    "tanh": PlantKind("a gain that bends as a hyperbolic tangent", _WORLD, _bent),
    "notch": PlantKind("a notch filter in the command path", _WORLD, _notched),
    "create": kind_of(load_plant(CREATE_FILE)),
}
