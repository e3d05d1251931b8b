"""A profile for `mtm-audit decode --profile` and `plan --profile` from measured responses."""

from collections.abc import Sequence

import numpy as np

from hil.experiments.identify.spectra import RATE_HZ, CrossSpectra
from hil.plants.linear_response import LinearResponse
from mtm_audit.detectors.matched.axis_response import AxisResponse
from mtm_audit.detectors.matched.plants import FINE, TAP_S
from mtm_audit.detectors.matched.profile import PlantProfile
from mtm_audit.model.track import Floats

# A plant of the family stands for a response when it misses less than this of it; and how fast belief falls with that.
MOST_MISSED, _TOLERANCE = 0.4, 0.15
_HZ = np.linspace(0.5, 3.0, 26)
# Of the rows that say how an axis follows and moves; each is of the spectra from half to double the distance of two.
_ROWS_HZ = np.geomspace(0.15, 8.0, 18)


def missed(response: LinearResponse) -> Floats:
    """(plants,): the share of the response between 0.5 and 3 Hz that each of the family, with the best gain, misses."""
    instants_s = (np.arange(FINE.taps.shape[1]) + 0.5) * TAP_S
    family = FINE.taps @ np.exp(-2j * np.pi * instants_s[:, None] * _HZ)
    wanted = response.at(_HZ)
    gains = np.sum((family.conj() * wanted).real, axis=1) / np.sum(np.abs(family) ** 2, axis=1)
    left = np.sum(np.abs(wanted - gains[:, None] * family) ** 2, axis=1)
    return np.asarray(np.sqrt(left / np.sum(np.abs(wanted) ** 2)))


def profile_of(responses: Sequence[LinearResponse]) -> PlantProfile | None:
    """Weights of the family's plants, the mean over the responses; None when it holds none like one of them."""
    weights = np.zeros(len(FINE.taps))
    for response in responses:
        shares = missed(response)
        if shares.min() > MOST_MISSED:
            return None
        likely = np.exp(-0.5 * (shares**2 - shares.min() ** 2) / _TOLERANCE**2)
        weights += likely / likely.sum()
    return PlantProfile(weights / weights.sum())


def axis_response(name: str, responses: Sequence[LinearResponse], spectra: Sequence[CrossSpectra]) -> AxisResponse:
    """How one axis of several robots follows, by the fitted responses, and how it moved: their mean powers.

    All motion counts, the task's own included, since that is in the way of a message; so the logs are of a task without
    one. Each bin of the spectra is a mean over its length, which is taken off again.
    """
    gains = np.sqrt(np.mean([np.abs(response.at(_ROWS_HZ)) ** 2 for response in responses], axis=0))
    frequencies_hz = spectra[0].frequencies_hz
    moved = np.mean([own.power_out for own in spectra], axis=0) / np.sinc(frequencies_hz / RATE_HZ) ** 2
    ratio = np.sqrt(_ROWS_HZ[1] / _ROWS_HZ[0])
    rows = []
    for hz, gain in zip(_ROWS_HZ.tolist(), gains.tolist(), strict=True):
        near = (frequencies_hz >= hz / ratio) & (frequencies_hz <= hz * ratio)
        near[np.argmin(np.abs(frequencies_hz - hz))] = True
        rows.append((hz, gain, max(float(moved[near].mean()), 1e-30)))
    return AxisResponse(name, tuple(rows))
