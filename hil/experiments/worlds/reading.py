"""Scores of every window of a filmed rollout, from the paper's detector and from the matched one.

The start of each window is given. The paper's detector searches its 101 rates in each window all the same (appendix
"Detection Pipeline Details"); the matched one knows nothing of the plant.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.detectors.coherency import own_axes, rate_searched_scores
from mtm_audit.detectors.matched.candidates import WindowTones
from mtm_audit.detectors.matched.estimate import estimate, fit_recording_noise
from mtm_audit.detectors.matched.motion import Motion, uniform_motion
from mtm_audit.detectors.matched.windows import make_window
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.timing import Timing
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Channel, Codebook, Scheme

COHERENCY, MATCHED = "coherency", "matched"


@dataclass(frozen=True)
class ObservedShot:
    """One shot as the auditor observes it.

    `start_s` is the instant of its first tick, `ticks` which of the rollout's ticks it shows, `glimpses` each body's
    motion by name.
    """

    start_s: float
    ticks: range
    glimpses: dict[str, Glimpse]


@dataclass(frozen=True)
class _Place:
    """One window of one channel: the shot it is in, when it began, and by how much its time goes slower than ours."""

    shot: int
    onset_s: float
    drift: float = 0.0


def read_windows(
    codebook: Codebook, seen: Sequence[ObservedShot], messages: int, detector: str, delays: Floats | None = None
) -> list[Floats]:
    """For each channel its windows' scores in order, (messages * l_c, M), larger for a likelier symbol.

    `delays` (windows, 2), for the matched detector and one channel: by how many seconds each window began late, and by
    how many for each second it is later at its end.
    """
    scheme = codebook.scheme
    places = [_places(scheme, channel, seen, messages) for channel in scheme.channels]
    if delays is not None:
        places = [
            [
                _Place(place.shot, place.onset_s + late_s, drift)
                for place, (late_s, drift) in zip(own, delays, strict=True)
            ]
            for own in places
        ]
    read: Callable[[Codebook, Sequence[ObservedShot], Sequence[list[_Place]]], list[Floats]]
    read = {COHERENCY: _coherency, MATCHED: _matched}[detector]
    return read(codebook, seen, places)


def pooled_scores(scores: Sequence[Floats], detector: str) -> Floats:
    """Pooled scores of channels that carry the same: the mean of coherencies, the sum of log-likelihood ratios."""
    return np.asarray(np.mean(scores, axis=0) if detector == COHERENCY else np.sum(scores, axis=0))


def _places(scheme: Scheme, channel: Channel, seen: Sequence[ObservedShot], messages: int) -> list[_Place]:
    ticks = scheme.window_ticks(channel)
    places = []
    for first in range(0, messages * scheme.message_ticks, ticks):
        shot = next(number for number, one in enumerate(seen) if first in one.ticks)
        places.append(_Place(shot, seen[shot].start_s + (first - seen[shot].ticks.start) / scheme.rate_hz))
    return places


def _coherency(codebook: Codebook, seen: Sequence[ObservedShot], places: Sequence[list[_Place]]) -> list[Floats]:
    return [
        np.array(
            [
                rate_searched_scores(codebook, channel, seen[place.shot].glimpses[channel.body], place.onset_s)
                for place in own
            ]
        )
        for channel, own in zip(codebook.scheme.channels, places, strict=True)
    ]  # fmt: skip


def _matched(codebook: Codebook, seen: Sequence[ObservedShot], places: Sequence[list[_Place]]) -> list[Floats]:
    """All windows of all channels together, since they share the plant."""
    scheme = codebook.scheme
    motions: list[Motion] = []
    windows = []
    for channel, own in zip(scheme.channels, places, strict=True):
        tones = WindowTones(codebook, channel, 0)
        first = len(motions)
        glimpses = [_observed(scheme, channel, shot.glimpses[channel.body]) for shot in seen]
        motions += [uniform_motion(glimpse, scheme.band_hz[1]) for glimpse in glimpses]
        for number, place in enumerate(own):
            timing = Timing(place.onset_s, scheme.rate_hz / (1.0 + place.drift))
            observation = first + place.shot
            windows.append(make_window(codebook, channel, motions[observation], timing, observation, 0, number, tones))
    result = iter(estimate(windows, motions, fit_recording_noise(motions, [own.velocities for own in motions])).ratios)
    return [np.array([next(result) for _ in own]) for own in places]


def _observed(scheme: Scheme, channel: Channel, glimpse: Glimpse) -> Glimpse:
    """All axes of the body, or the channel's own where another channel moves the others."""
    alone = sum(other.body == channel.body for other in scheme.channels) == 1
    return glimpse if alone else own_axes(channel, glimpse)
