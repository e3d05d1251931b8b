"""How a camera moves that nobody fixed: it shakes, rolls and pans."""

from dataclasses import dataclass, replace

import numpy as np

from hil.sensors.optics import Optics
from hil.sensors.poses import Floats
from mtm_onboard.protocol.errors import MtmError

LOWEST_HZ, TONES = 0.1, 60
# The hand turns the camera about a point behind it, so that the camera also shifts by as much.
LEVER_M = 0.3
ROLL_PERIOD_S = 9.0


@dataclass(frozen=True, kw_only=True)
class CameraMotion:
    """What a hand does with a camera.

    `shake_px` is the rms shift of the middle of the picture in each direction, in tones from 0.1 to `shake_hz` whose
    power falls with the frequency; the camera turns about its axis by angles of the same size. It rolls to and fro by
    `roll_rad` and pans from half of `pan_rad` left of its aim to as much right of it.
    """

    shake_px: float = 0.0
    shake_hz: float = 3.0
    roll_rad: float = 0.0
    pan_rad: float = 0.0

    def __post_init__(self) -> None:
        if self.shake_hz <= LOWEST_HZ or self.shake_px < 0.0:
            raise MtmError(f"a shake has a size from 0 on and reaches beyond {LOWEST_HZ} Hz; choose such a one")

    def turned(self, optics: Optics, instants_s: Floats, duration_s: float, rng: np.random.Generator) -> list[Optics]:
        """The optics at `instants_s` (n,) of a recording of `duration_s`."""
        angles = self.shake_px / optics.focal_px * self._shake(instants_s, rng)
        levers_m = LEVER_M * angles[:, :2]
        angles[:, 0] += self.pan_rad * (instants_s / duration_s - 0.5)
        angles[:, 2] += self.roll_rad * np.sin(2 * np.pi * (instants_s / ROLL_PERIOD_S + rng.random()))
        right, down, _ = optics.rotation
        positions = np.asarray(optics.position_m) + levers_m[:, :1] * right + levers_m[:, 1:] * down
        targets = positions - optics.position_m + np.asarray(optics.target_m)
        return [
            replace(
                optics,
                position_m=(float(x), float(y), float(z)),
                target_m=(float(u), float(v), float(w)),
                turn_rad=(float(pan), float(tilt), float(roll)),
            )
            for (x, y, z), (u, v, w), (pan, tilt, roll) in zip(positions, targets, angles, strict=True)
        ]

    def _shake(self, instants_s: Floats, rng: np.random.Generator) -> Floats:
        """Three signals (n, 3) of unit rms."""
        frequencies_hz = np.geomspace(LOWEST_HZ, self.shake_hz, TONES)
        tones = np.exp(2j * np.pi * frequencies_hz * instants_s[:, None])
        # Equal power to each tone is power that falls with the frequency, since the tones lie closer at its low end.
        phases = np.exp(2j * np.pi * rng.random((TONES, 3)))
        return np.asarray(np.real(tones @ phases) * np.sqrt(2.0 / TONES), dtype=np.float64)
