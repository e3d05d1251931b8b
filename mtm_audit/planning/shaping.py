"""A spectrum for a scheme, from what a profile says of the robots' axes."""

from dataclasses import dataclass, replace

import numpy as np

from mtm_audit.detectors.matched.profile import PlantProfile
from mtm_audit.model.track import Floats
from mtm_audit.planning.waterfill import FAINTEST_DB, capacity_bps, spectrum_points, water_filled
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Scheme
from mtm_onboard.protocol.spectrum import Points, tone_powers

_FREQUENCIES = 400
_POINTS = 8


@dataclass(frozen=True)
class Shaping:
    """A proposed spectrum and what a message could carry by capacity, bits/s over all channels: flat, with the
    proposal, and with the best spectrum of all; `carrying_hz` is where it is not `FAINTEST_DB` below its loudest.
    """

    spectrum: Points
    flat_bps: float
    proposed_bps: float
    best_bps: float
    carrying_hz: tuple[float, float]


def shaping_for(scheme: Scheme, profile: PlantProfile) -> Shaping:
    """The water-filled spectrum of the scheme's band; raises MtmError when the profile lacks one of its axes."""
    frequencies_hz, ratios = signal_to_motion(scheme, profile)
    width_hz = scheme.band_hz[1] - scheme.band_hz[0]
    best = water_filled(ratios)
    points = spectrum_points(frequencies_hz, best, _POINTS)
    heard = frequencies_hz[best > best.max() * 10.0 ** (FAINTEST_DB / 10.0)]

    def carried_bps(powers: Floats) -> float:
        return capacity_bps(ratios, powers, width_hz)

    return Shaping(
        points,
        flat_bps=carried_bps(np.ones(len(frequencies_hz))),
        proposed_bps=carried_bps(tone_powers(points, frequencies_hz)),
        best_bps=carried_bps(best),
        carrying_hz=(float(heard[0]), float(heard[-1])),
    )


def signal_to_motion(scheme: Scheme, profile: PlantProfile) -> tuple[np.ndarray, Floats]:
    """Frequencies (K,) evenly over the band, and the noise's density beside that of the robot's own motion for an even
    share, (axes of all channels, K).
    """
    known = {axis.name: axis for axis in profile.axes}
    asked = [pair for channel in scheme.channels for pair in zip(channel.axes, channel.sigmas, strict=True)]
    lacking = [axis for axis, _ in asked if axis not in known]
    if lacking:
        raise MtmError(
            f"the profile does not say how the axis {lacking[0]} follows and moves; make one with mtm-hil identify "
            "from a robot that is commanded on it, or leave out --profile"
        )
    low_hz, high_hz = scheme.band_hz
    frequencies_hz = np.linspace(low_hz, high_hz, _FREQUENCIES)
    ratios = []
    for axis, sigma in asked:
        gains, densities = known[axis].at(frequencies_hz)
        ratios.append(sigma**2 / (high_hz - low_hz) * gains**2 / densities)
    return frequencies_hz, np.array(ratios)


def shaped(scheme: Scheme, shaping: Shaping) -> Scheme:
    """The scheme with the proposed spectrum; its name says so."""
    return replace(scheme, name=f"{scheme.name}-filled", spectrum=shaping.spectrum)


def shaping_text(shaping: Shaping) -> str:
    """The proposal in one line, as `mtm-onboard keygen --spectrum` takes it."""
    points = ",".join(f"{hz:g}:{level_db:g}" for hz, level_db in shaping.spectrum)
    low_hz, high_hz = shaping.carrying_hz
    return (
        f"spectrum {points}: by capacity {shaping.proposed_bps:.2f} bits/s, flat {shaping.flat_bps:.2f}, at the best "
        f"{shaping.best_bps:.2f}; it carries from {low_hz:.2g} to {high_hz:.2g} Hz"
    )
