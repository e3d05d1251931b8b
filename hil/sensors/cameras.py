"""The cameras and the floors that a recording can be made with, by name."""

from hil.sensors.camera import Camera
from hil.sensors.optics import Optics, overhead
from hil.sensors.scene import Scene

_TILTED = Optics(
    position_m=(0.6, -4.6, 4.4),
    target_m=(0.0, 0.0, 0.0),
    focal_px=1080.0,
    width_px=1280,
    height_px=960,
    radial=(-0.05, 0.0),
)

# Numbers far from the robots' own, near the corners of the arena.
FLOOR_MARKERS = ((40, -1.6, -1.6), (41, 1.6, -1.6), (42, -1.6, 1.6), (43, 1.6, 1.6))
FLOORS = {"mat": Scene(), "carpet": Scene(floor="carpet"), "markers": Scene(floor_markers=FLOOR_MARKERS)}

CAMERAS: dict[str, Camera] = {
    # Fixed under the ceiling, as a tracking system's would be.
    "overhead": Camera(optics=overhead(), noise_levels=1.0, blur_px=0.6),
    # On a stand beside the arena, with a lens that distorts and a shutter that takes its time.
    "tilted": Camera(optics=_TILTED, noise_levels=1.0, blur_px=0.6, exposure_s=0.004, sub_exposures=2),
    # Held by hand: uneven frames, some of them lost, and a longer shutter.
    "phone": Camera(
        optics=Optics(
            position_m=(0.3, -4.4, 4.6),
            target_m=(0.05, 0.0, 0.0),
            focal_px=1060.0,
            width_px=1280,
            height_px=960,
            roll_rad=0.08,
        ),
        jitter_s=0.004,
        drop_probability=0.02,
        exposure_s=0.008,
        noise_levels=2.0,
        blur_px=0.8,
    ),
}
