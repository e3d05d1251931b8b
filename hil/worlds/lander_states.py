"""The columns of the Lunar Lander's states: what is written of the simulator at each tick, and drawn from it.

A row has the terrain's heights, then x, y and angle of the lander and of its two legs, then x, y and remaining life of
each particle of the flames, oldest first, NaN where there are fewer.
"""

import math

import numpy as np
from gymnasium.envs.box2d import lunar_lander

from mtm_audit.model.track import Floats

TERRAIN_POINTS = 11
BODIES = 3
# A particle lives for at most seven pictures, and two are born in a tick.
MAX_PARTICLES = 16
FADING_PER_PICTURE = 0.15


def state_of(environment: lunar_lander.LunarLander) -> Floats:
    """One row of states; the flames fade by a picture, which Gymnasium does as it draws them."""
    for particle in environment.particles:
        particle.ttl -= FADING_PER_PICTURE
    environment._clean_particles(False)  # type: ignore[no-untyped-call]
    terrain = [polygon[0][1] for polygon in environment.sky_polys] + [environment.sky_polys[-1][1][1]]
    bodies = [(*body.position, body.angle) for body in environment.drawlist]
    flames = [(*particle.position, particle.ttl) for particle in environment.particles]
    flames += [(math.nan,) * 3] * (MAX_PARTICLES - len(flames))
    return np.concatenate([terrain, np.ravel(bodies), np.ravel(flames)])


def parts_of(state: Floats) -> tuple[Floats, Floats]:
    """Rows of x, y, angle of the lander and its legs, and of x, y, life of the flames' particles."""
    parts = state[TERRAIN_POINTS:].reshape(-1, 3)
    flames = parts[BODIES:]
    return parts[:BODIES], flames[~np.isnan(flames[:, 0])]
