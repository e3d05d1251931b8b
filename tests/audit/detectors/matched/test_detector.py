from dataclasses import replace

import numpy as np
import pytest

from mtm_audit.detectors.base import Observation
from mtm_audit.detectors.matched import detector
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.model.glimpse import glimpse_of_track
from tests.audit.detectors.matched.fleet_motion import START_S, fleet_run


@pytest.fixture(scope="module")
def run():
    return fleet_run(31, message_ticks=100, seconds=START_S + 8.0)


def read(run):
    seen = [
        Observation(channel, glimpse_of_track(track))
        for channel, track in zip(run.key.scheme.channels, run.tracks, strict=True)
    ]
    return [reading.reading for reading in MatchedDetector().read(run.key.codebook(), [], seen, START_S)]


def test_symbols_are_read_under_the_refined_timing(run, monkeypatch):
    asked = []

    def later(found, windows, motions, timings):
        asked.append([len(found.signals), len(windows), len(motions)])
        return [replace(timing, onset_s=timing.onset_s + 0.5) for timing in timings]

    plain = read(run)
    monkeypatch.setattr(detector, "refined_timing", later)
    moved = read(run)
    for one, other in zip(plain, moved, strict=True):
        assert other.window_starts_s[0] == pytest.approx(other.timing.onset_s, abs=1e-9)
        # Half a second beside the message there is nothing of it.
        assert other.scores.max() < one.scores.max()
    assert len(asked) == 1
    assert asked[0][0] == asked[0][1]
    assert asked[0][2] == len(run.tracks)


def test_a_timing_that_needs_no_refining_is_read_once(run, monkeypatch):
    estimates = []
    plain = detector.estimate
    monkeypatch.setattr(detector, "refined_timing", lambda found, windows, motions, timings: timings)
    monkeypatch.setattr(detector, "estimate", lambda *asked: estimates.append(asked) or plain(*asked))
    readings = read(run)
    assert len(estimates) == 1
    assert [int(np.argmax(reading.scores)) for reading in readings] == list(run.symbols)
