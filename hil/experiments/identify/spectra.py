"""Welch's cross spectra of commands and motion, over the pieces of a run in which the robot was seen throughout."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hil.experiments.identify.logs import LoggedRun
from hil.plants.linear_response import Complexes
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import MtmError

RATE_HZ = 20.0
SEGMENT_S = 12.8
_FEWEST_SEGMENTS = 8


@dataclass(frozen=True)
class CrossSpectra:
    """One axis: one-sided power densities of the command and the motion, `power_in` and `power_out`, and their `cross`
    density, at `frequencies_hz`, averaged over `segments` that half overlap.
    """

    frequencies_hz: Floats
    power_in: Floats
    power_out: Floats
    cross: Complexes
    segments: int

    @property
    def gain(self) -> Complexes:
        """The response of the motion to the command."""
        return np.asarray(self.cross / np.maximum(self.power_in, 1e-30))

    @property
    def coherence(self) -> Floats:
        """The share of the motion's power that the command explains, 0 to 1."""
        return np.asarray(np.abs(self.cross) ** 2 / np.maximum(self.power_in * self.power_out, 1e-30))

    @property
    def unexplained(self) -> Floats:
        """Power density of the motion that the command does not explain; few segments explain some by chance."""
        return np.asarray(self.power_out * (1.0 - self.coherence) * self.segments / max(1, self.segments - 1))

    def unexplained_rms(self, low_hz: float, high_hz: float) -> float:
        """Its root mean square between two frequencies."""
        inside = (self.frequencies_hz >= low_hz) & (self.frequencies_hz <= high_hz)
        return float(np.sqrt(np.sum(self.unexplained[inside]) * self.frequencies_hz[1]))


def cross_spectra(runs: Sequence[LoggedRun], axis: int) -> CrossSpectra:
    """Of one axis (0 to 2: vx, vy, wz) over all runs, which have one step; raises MtmError when they are too short."""
    length = round(SEGMENT_S * RATE_HZ)
    window = np.hanning(length + 1)[:-1]
    count = 0
    sums = np.zeros((3, length // 2 + 1), dtype=complex)
    for run in runs:
        for start in range(0, len(run.seen) - length + 1, length // 2):
            part = slice(start, start + length)
            if not np.all(run.seen[part]):
                continue
            one, other = (
                np.fft.rfft(window * (own[part, axis] - own[part, axis].mean())) for own in (run.commanded, run.moved)
            )
            sums += np.stack([np.abs(one) ** 2 + 0j, np.abs(other) ** 2 + 0j, np.conj(one) * other])
            count += 1
    if count < _FEWEST_SEGMENTS:
        raise MtmError(
            f"the robot was seen without a gap in {count} pieces of {SEGMENT_S} s; it takes {_FEWEST_SEGMENTS} of "
            "them, so name longer logs"
        )
    scale = 2.0 / (RATE_HZ * np.sum(window**2) * count)
    densities = scale * sums
    return CrossSpectra(
        np.fft.rfftfreq(length, 1.0 / RATE_HZ), densities[0].real, densities[1].real, densities[2], count
    )
