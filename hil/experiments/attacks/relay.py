"""The motion of now, shown later: whether a decode under default keys calls it authenticated, by how late it is.

The film's time is known to 2 s. What is shown an hour or days later (a replay) is the same with a larger delay.
"""

from collections.abc import Mapping
from dataclasses import replace

from hil.experiments.attacks.attack import Attack
from hil.experiments.attacks.authenticated import AUTHENTICATED, authenticated
from hil.experiments.runs.cells import Scalar
from hil.experiments.verdicts.forgers import ATTACKS, Film, Fleet

ARM = "--at-error 2"
_LEVELS = (0.0, 1.0, 2.0, 2.3, 2.6, 3.0, 5.0, 30.0, 3600.0)


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    def relayed(fleet: Fleet) -> Film:
        film = ATTACKS["replay"].control(fleet)
        return replace(film, began_unix_s=film.began_unix_s + level)

    return authenticated(relayed, rollouts, seed)


ATTACK = Attack(
    name="relay", level="how late, s", counted=AUTHENTICATED, levels={ARM: _LEVELS}, measure=_measure,
    chance_percent=0.0, share=0.4, batch=5,
)  # fmt: skip
