"""Latitudes and longitudes as metres on the ground."""

import numpy as np

from mtm_audit.model.track import Floats

_EQUATOR_M, _FLATTENING = 6_378_137.0, 1.0 / 298.257223563


def north_east_m(latitudes_deg: Floats, longitudes_deg: Floats) -> tuple[Floats, Floats]:
    """Metres north and east of the first position that is known, on the plane that touches WGS 84 there."""
    known = np.flatnonzero(np.isfinite(latitudes_deg) & np.isfinite(longitudes_deg))
    if not len(known):
        return latitudes_deg, longitudes_deg
    latitude, longitude = np.deg2rad(latitudes_deg[known[0]]), np.deg2rad(longitudes_deg[known[0]])
    squashed = _FLATTENING * (2.0 - _FLATTENING)
    narrowing = 1.0 - squashed * np.sin(latitude) ** 2
    along_m = _EQUATOR_M * (1.0 - squashed) / narrowing**1.5
    across_m = _EQUATOR_M / np.sqrt(narrowing) * np.cos(latitude)
    # The date line is not crossed by jumping round the earth.
    turned = np.angle(np.exp(1j * (np.deg2rad(longitudes_deg) - longitude)))
    return (np.deg2rad(latitudes_deg) - latitude) * along_m, turned * across_m
