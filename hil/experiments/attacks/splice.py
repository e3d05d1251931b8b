"""Windows of overheard messages among those of now: whether a decode calls it authenticated, by how many are foreign.

Of ten windows, under default keys, whose code puts right a few. What it puts right is what was sent: nobody who
replaces windows chooses what is read.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hil.experiments.attacks.attack import Attack
from hil.experiments.attacks.authenticated import AUTHENTICATED, authenticated
from hil.experiments.runs.cells import Scalar
from hil.experiments.verdicts.forgers import ATTACKS, ONE_ROBOT, Film, Fleet

ARM = "default keys"
_LEVELS = (0.0, 1.0, 2.0, 3.0, 5.0, 10.0)


def spliced(foreign: int, fleet: Fleet) -> Film:
    """The message of now with so many of its windows taken from the slot before."""
    film = ATTACKS["replay"].control(fleet)
    (own,), (old,) = film.noise, fleet.sent(fleet.slot - 1, fleet.payload())
    ticks = ONE_ROBOT.window_ticks(ONE_ROBOT.channels[0])
    noise = own.copy()
    for place in fleet.draw.choice(ONE_ROBOT.channels[0].symbols, foreign, replace=False):
        noise[place * ticks : (place + 1) * ticks] = old[place * ticks : (place + 1) * ticks]
    return replace(film, noise=(np.asarray(noise),))


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    return authenticated(lambda fleet: spliced(round(level), fleet), rollouts, seed)


ATTACK = Attack(
    name="splice", level="foreign windows of ten", counted=AUTHENTICATED, levels={ARM: _LEVELS}, measure=_measure,
    chance_percent=0.0, share=0.4, batch=5,
)  # fmt: skip
