"""Symbols and gains of all windows together, on statistics whose truth is drawn."""

import numpy as np
import pytest

from mtm_audit.detectors.matched.joint import decide_together
from mtm_audit.detectors.matched.windows import Statistics

WINDOWS, CANDIDATES, CELLS = 6, 16, 60
# Two plants, of which the second is nothing like the truth.
LOG_PRIOR = np.log([0.5, 0.5])
TURNED = np.array([[0.15, 0.4], [-0.4, 0.15]])


def drawn(seed, gains=TURNED, windows=WINDOWS):
    """Statistics of windows that play waveforms (candidates, 2, cells) with these gains, and the symbols sent."""
    draw = np.random.default_rng(seed)
    sent = draw.integers(0, CANDIDATES, windows)
    found = []
    for symbol in sent:
        waves = draw.standard_normal((2, CANDIDATES, 2, CELLS))
        heard = gains @ waves[0, symbol] + draw.standard_normal((2, CELLS))
        information = np.einsum("plan,dn->dlpa", waves, heard)
        precision = np.broadcast_to(np.einsum("plan,plbn->lpab", waves, waves), (2, CANDIDATES, 2, 2, 2))
        found.append(Statistics(information, precision))
    return found, sent


def together(found, groups=None, elsewhere=None):
    beside = [np.zeros(CANDIDATES)] * len(found) if elsewhere is None else elsewhere
    return decide_together(found, beside, range(len(found)) if groups is None else groups, CANDIDATES, LOG_PRIOR)


def alone(found):
    return np.array([np.argmax(together([window]).beliefs[0]) for window in found])


def test_windows_show_together_what_none_shows_alone():
    right_alone, right_together = 0, 0
    for seed in range(20):
        found, sent = drawn(seed)
        right_alone += int(np.sum(alone(found) == sent))
        right_together += int(np.sum(np.argmax(together(found).beliefs, axis=1) == sent))
    assert right_together >= right_alone + 5
    assert right_together > 0.95 * 20 * WINDOWS


@pytest.mark.parametrize("mirror", [1.0, -1.0], ids=["turned", "mirrored"])
@pytest.mark.parametrize("angle_rad", [0.0, 0.8, 2.4, 4.1])
def test_every_turn_of_the_camera_is_found(angle_rad, mirror):
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    found, sent = drawn(5, 0.6 * np.array([[cosine, -sine], [sine, cosine]]) @ np.diag([1.0, mirror]))
    assert np.array_equal(np.argmax(together(found).beliefs, axis=1), sent)


def test_noise_alone_speaks_for_no_message():
    for seed in range(10):
        found, _ = drawn(seed, np.zeros((2, 2)))
        assert together(found).evidence < 3.0


def test_a_message_speaks_the_louder_the_more_windows_show_it():
    few, many = (together(drawn(3, windows=windows)[0]).evidence for windows in (3, 9))
    assert 0.0 < few < many


def test_repeats_of_a_symbol_are_believed_alike():
    found, sent = drawn(8)
    twice = [*found, *drawn(8)[0]]
    believed = together(twice, [*range(WINDOWS), *range(WINDOWS)]).beliefs
    assert np.array_equal(believed[:WINDOWS], believed[WINDOWS:])
    assert np.array_equal(np.argmax(believed[:WINDOWS], axis=1), sent)


def test_what_is_known_from_elsewhere_counts():
    found, sent = drawn(4, 0.05 * TURNED)
    beside = [20.0 * (np.arange(CANDIDATES) == symbol) for symbol in sent]
    assert np.array_equal(np.argmax(together(found, elsewhere=beside).beliefs, axis=1), sent)


def test_many_windows_are_weighed_in_blocks_alike(monkeypatch):
    found, _ = drawn(2)
    whole = together(found)
    monkeypatch.setattr("mtm_audit.detectors.matched.joint._MOST_TOGETHER", WINDOWS * CANDIDATES * 8)
    parts = together(found)
    assert parts.beliefs == pytest.approx(whole.beliefs, abs=1e-5)
    assert parts.evidence == pytest.approx(whole.evidence, abs=1e-3)
