"""A Butterworth band-stop filter on the commands, over the watermark's band (the paper's table tab:adv-bandstop).

The paper says that its band overlaps the policy's dominant frequencies and not which one it is, nor whether it counts
the order of the lowpass prototype, as SciPy and MATLAB do, or of the whole filter, which is twice that. The band here
is that of the paper's detection appendix, and both ways of counting are measured.
"""

from collections.abc import Mapping

import numpy as np
from scipy import signal

from hil.experiments.attacks.attack import Attack, PaperFigure
from hil.experiments.attacks.driving import CHANCE_PERCENT, SCHEME, suppressed
from hil.experiments.runs.cells import Scalar
from hil.worlds.discovery import Tamper, Tick
from mtm_audit.model.track import Floats

OF_PROTOTYPE, OF_WHOLE = "order of the prototype", "order of the whole filter"
_PAPER = {
    0.0: (100.0, 0.128, 0.0, 0.0), 2.0: (22.5, 0.035, 36.2, 4.3), 4.0: (14.0, 0.033, 46.9, 8.1),
    6.0: (12.3, 0.031, 53.6, 12.2), 8.0: (14.0, 0.031, 59.9, 16.7), 10.0: (12.0, 0.030, 66.5, 21.5),
}  # fmt: skip


def without_band(band_hz: tuple[float, float], order: int) -> Tamper:
    """Filters all commands, tick by tick; order 0 lets them pass."""
    if order == 0:
        return lambda tick: tick.requested_mps
    sections = signal.butter(order, band_hz, "bandstop", fs=SCHEME.rate_hz, output="sos")
    state: list[Floats] = []

    def tamper(tick: Tick) -> Floats:
        commands = tick.requested_mps[None]
        if not state:
            # At rest before: no command was given.
            state.append(np.zeros((len(sections), 2, *tick.requested_mps.shape)))
        filtered, state[0] = signal.sosfilt(sections, commands, axis=0, zi=state[0])
        return np.asarray(filtered[0])

    return tamper


def _measure(arm: str, level: float, rollouts: int, seed: int) -> Mapping[str, Scalar]:
    order = round(level if arm == OF_PROTOTYPE else level / 2.0)
    return suppressed(lambda count, draw: without_band(SCHEME.band_hz, order), rollouts, seed)


_ARMS = OF_PROTOTYPE, OF_WHOLE
ATTACK = Attack(
    name="band_stop", level="order of the filter", counted="messages right", levels=dict.fromkeys(_ARMS, tuple(_PAPER)),
    measure=_measure, chance_percent=CHANCE_PERCENT, share=1.0, batch=25,
    paper={
        (arm, level): PaperFigure("tab:adv-bandstop", *figures) for arm in _ARMS for level, figures in _PAPER.items()
    },
)  # fmt: skip
