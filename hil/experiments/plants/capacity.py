"""Shannon's bound for one robot by axis and by loudness: the identified two-wheeled robots beside the RoboMaster.

What is in a message's way is told apart: the slip alone, for somebody who knows what the task commands and sees
exactly, and all motion that is seen without a message, for somebody who does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from hil.experiments.detectors.bench_rollout import silent_motions
from hil.experiments.detectors.capacity import gain, motion_density
from hil.plants.family import CREATE_FILE, ROBOMASTER
from hil.plants.interference import slip_density
from hil.plants.mecanum import calibrated_parameters
from hil.plants.plant_file import IdentifiedAxis, load_plant
from hil.sensors.motion_capture import MotionCapture
from mtm_audit.detectors.matched.axis_response import AxisResponse
from mtm_audit.detectors.matched.plants import FINE
from mtm_audit.detectors.matched.profile import PlantProfile, load_profile
from mtm_audit.model.track import Floats
from mtm_audit.planning.shaping import shaping_for
from mtm_onboard.protocol import Channel, Scheme

CREATE = "create"
SLIP, MOTION = "slip", "motion"
# Forward speed in m/s and turn rate in rad/s.
SIGMAS = ((0.1, 0.2), (0.02, 0.1), (0.01, 0.05))

# The presets' band on each, and a wider one; the Create's response is known from 0.3 to 4 Hz.
BANDS_HZ = {CREATE: (0.5, 2.5), ROBOMASTER: (0.5, 5.0)}
WIDE_HZ = {CREATE: (0.3, 4.0), ROBOMASTER: (0.3, 8.0)}
AXES = {
    CREATE: (("vx",), ("wz",), ("vx", "wz")),
    ROBOMASTER: (("vx",), ("wz",), ("vx", "wz"), ("vx", "vy"), ("vx", "vy", "wz")),
}
CREATE_PROFILE = CREATE_FILE.with_name("create_profile.toml")

_RATE_HZ = 50.0
_ROWS_HZ = np.asarray(np.geomspace(0.25, 8.0, 120), dtype=np.float64)
_SILENCES, _SILENT_S = 12, 17.5

# The axes of one robot.
Axes = tuple[AxisResponse, ...]


@dataclass(frozen=True, kw_only=True)
class Capacity:
    """Bits per second of one robot of `plant` over `axes`, `against` one of `SLIP` and `MOTION`.

    With the power flat in the preset's band, with the best spectrum there, and with the best one in the wide band; the
    mean over `robots`, and the least and the most of any of them for the flat one.
    """

    plant: str
    against: str
    axes: tuple[str, ...]
    sigmas: tuple[float, float]
    robots: int
    flat_bps: float
    least_bps: float
    most_bps: float
    filled_bps: float
    wide_bps: float


def capacities() -> list[Capacity]:
    """All plants, what is in the way, axes and loudnesses, in this order."""
    return [
        capacity_of(plant, against, axes, sigmas)
        for plant in (CREATE, ROBOMASTER)
        for against in (SLIP, MOTION)
        for axes in AXES[plant]
        for sigmas in SIGMAS
    ]


def capacity_of(plant: str, against: str, axes: tuple[str, ...], sigmas: tuple[float, float]) -> Capacity:
    """One row of the table."""
    robots = robots_of(plant, against)
    scheme, wide = (_scheme(axes, sigmas, bands[plant]) for bands in (BANDS_HZ, WIDE_HZ))
    narrow = [shaping_for(scheme, _profile(own)) for own in robots]
    flat = [shaping.flat_bps for shaping in narrow]
    return Capacity(
        plant=plant,
        against=against,
        axes=axes,
        sigmas=sigmas,
        robots=len(robots),
        flat_bps=float(np.mean(flat)),
        least_bps=min(flat),
        most_bps=max(flat),
        filled_bps=float(np.mean([shaping.best_bps for shaping in narrow])),
        wide_bps=float(np.mean([shaping_for(wide, _profile(own)).best_bps for own in robots])),
    )


@cache
def robots_of(plant: str, against: str) -> tuple[Axes, ...]:
    """The robots of that plant. Of the Create's whole motion the mean over its ten runs is known."""
    if plant == ROBOMASTER:
        return (_robomaster(against),)
    if against == MOTION:
        return (load_profile(CREATE_PROFILE).axes,)
    return tuple(
        tuple(_identified(name, axis) for name, axis in robot.axes.items()) for robot in load_plant(CREATE_FILE).robots
    )


def _identified(name: str, axis: IdentifiedAxis) -> AxisResponse:
    return _response(
        name, np.abs(axis.response.at(_ROWS_HZ)), slip_density(axis.deviation, axis.correlation_s, _ROWS_HZ)
    )


def _robomaster(against: str) -> Axes:
    plant = calibrated_parameters()
    gains = gain(plant, _RATE_HZ, _ROWS_HZ)
    ground, turning = (
        slip_density(slip, plant.slip_correlation_s, _ROWS_HZ) for slip in (plant.slip_mps, plant.yaw_slip_radps)
    )
    ahead = left = ground
    if against == MOTION:
        silences = silent_motions(_SILENT_S, plant, _SILENCES, WIDE_HZ[ROBOMASTER][1])
        ahead, left = motion_density(silences, _ROWS_HZ)
        # The task never turns, and its controller turns back slip and message alike, which leaves their ratio as it is.
        # Only the tracking comes to it: white noise of the heading, whose rate is seen.
        sensor = MotionCapture()
        turning = turning + 2.0 / sensor.rate_hz * (2.0 * np.pi * _ROWS_HZ * sensor.heading_noise_rad) ** 2
    return tuple(_response(name, gains, density) for name, density in (("vx", ahead), ("vy", left), ("wz", turning)))


def _response(name: str, gains: Floats, densities: Floats) -> AxisResponse:
    return AxisResponse(name, tuple(zip(_ROWS_HZ.tolist(), gains.tolist(), densities.tolist(), strict=True)))


def _profile(axes: Axes) -> PlantProfile:
    return PlantProfile(np.full(len(FINE.taps), 1.0 / len(FINE.taps)), axes)


def _scheme(axes: Sequence[str], sigmas: tuple[float, float], band_hz: tuple[float, float]) -> Scheme:
    speed, turn = sigmas
    each = tuple(turn if axis == "wz" else speed for axis in axes)
    channel = Channel("robot", "robot", tuple(axes), 1, each)
    return Scheme(name="capacity", rate_hz=_RATE_HZ, band_hz=band_hz, alphabet_size=2, message_ticks=600,
                  channels=(channel,))  # fmt: skip
