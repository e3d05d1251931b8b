"""Films of one robot under default keys, and whether a decode calls them authenticated."""

from collections.abc import Callable, Mapping
from datetime import UTC, datetime

import numpy as np

from hil.experiments.attacks.attack import RIGHT, TRIALS
from hil.experiments.runs.cells import Scalar
from hil.experiments.verdicts.forgeries import decoded
from hil.experiments.verdicts.forgers import ONE_ROBOT, Film, Fleet, holder_of
from hil.experiments.worlds.reading import MATCHED
from mtm_onboard.protocol.slots import slot_at

AUTHENTICATED = "films called authenticated"
_STREAM = 22


def authenticated(make: Callable[[Fleet], Film], films: int, seed: int) -> Mapping[str, Scalar]:
    """Of so many films, one a slot of a Monday, how many are authenticated."""
    right = 0
    for number in range(films):
        draw = np.random.default_rng([_STREAM, seed + number])
        at_s = datetime(2026, 11, 30, 1, tzinfo=UTC).timestamp() + float(draw.uniform(0.0, 20 * 3600.0))
        fleet = Fleet(holder_of(0, ONE_ROBOT), ONE_ROBOT, slot_at(at_s, ONE_ROBOT), draw)
        right += "authenticated" in decoded(make(fleet), fleet)
    return {f"{MATCHED} {TRIALS}": films, f"{MATCHED} {RIGHT}": right}
