"""What a large alphabet's candidates take: one number each, for every window, held once."""

import numpy as np
import pytest

from mtm_audit.detectors.base import Observation
from mtm_audit.detectors.matched import estimate
from mtm_audit.detectors.matched.detector import MatchedDetector
from mtm_audit.model.glimpse import glimpse_of_track
from tests.audit.detectors.matched.fleet_motion import estimated, fleet_run
from tests.audit.moving_robot import key_of, robot_track, scheme_of

ALPHABET = 4096


@pytest.mark.parametrize("whole", [64, 600])
def test_single_precision_changes_nothing_that_matters(monkeypatch, whole):
    run = fleet_run(1, alphabet=600)
    plain = estimated(run)
    monkeypatch.setattr(estimate, "WHOLE", whole)
    found = estimated(run)
    assert found.ratios.dtype == (np.float32 if whole < 600 else np.float64)
    assert found.ratios.argmax(axis=1).tolist() == plain.ratios.argmax(axis=1).tolist()
    assert found.ratios == pytest.approx(plain.ratios, abs=1e-3)


def test_what_windows_say_of_all_candidates_is_held_once():
    """Six windows of each of two robots: their readings are parts of one table."""
    key = key_of(scheme_of(symbols=(2, 2), ticks=200, alphabet=ALPHABET))
    tracks = [robot_track(key, f"robot{n}", (7 + n, 300), 12.5, seed=n) for n in range(2)]
    observations = [
        Observation(channel, glimpse_of_track(track))
        for channel, track in zip(key.scheme.channels, tracks, strict=True)
    ]
    found = MatchedDetector().read(key.codebook(), [], observations, 0.0)
    tables = [each.reading.window_scores for each in found]
    assert all(each.window_ratios is table for each, table in zip(found, tables, strict=True))
    assert all(table.dtype == np.float32 and table.shape == (6, ALPHABET) for table in tables)
    assert tables[0].base is tables[1].base
