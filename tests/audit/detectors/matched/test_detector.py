from dataclasses import replace

import numpy as np
import pytest

from mtm_audit.detectors.base import Observation
from mtm_audit.detectors.matched import detector
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_onboard.protocol import Codebook
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

    def later(found, windows, motions, timings, clock_hz):
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
    monkeypatch.setattr(detector, "refined_timing", lambda found, windows, motions, timings, clock_hz: timings)
    monkeypatch.setattr(detector, "estimate", lambda *asked: estimates.append(asked) or plain(*asked))
    readings = read(run)
    assert len(estimates) == 1
    assert [int(np.argmax(reading.scores)) for reading in readings] == list(run.symbols)


def test_windows_far_longer_than_the_recording_are_not_sought(run, monkeypatch):
    """The search would take a memory of their length, 17 GB for ten minutes."""
    scheme = replace(run.key.scheme, message_ticks=30_000 * len(run.key.scheme.channels))
    monkeypatch.setattr(detector, "search_timings", lambda *asked, **named: pytest.fail("searched"))
    channel = scheme.channels[0]
    seen = glimpse_of_track(run.tracks[0])
    codebook = Codebook(b"another fake test secret 1234567", scheme)
    (refusal,) = MatchedDetector().read(codebook, [], [Observation(channel, seen)], START_S)
    assert "less than a third of a window" in str(refusal)
    assert np.isnan(MatchedDetector().strengths([codebook], [channel], [seen], None)).all()
