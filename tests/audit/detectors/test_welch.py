import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from mtm_audit.detectors.welch import mean_coherency, segment_length, segment_spectra

RNG = np.random.default_rng(5)


def scipy_mean(candidate, observed, bins):
    """The paper's statistic of one pair (axes, n), one axis after the other."""
    ticks = candidate.shape[-1]
    length = min(128, ticks // 2)
    values = [
        signal.coherence(
            x, y, fs=ticks, window="hann", nperseg=length, noverlap=3 * length // 4, nfft=ticks, detrend="constant"
        )[1][bins]
        for x, y in zip(candidate, observed, strict=True)
    ]
    return float(np.mean(np.sqrt(values)))


@given(ticks=st.integers(16, 700), axes=st.integers(1, 3), candidates=st.integers(1, 3), seed=st.integers(0, 2**32 - 1))
def test_every_pair_has_the_coherency_that_scipy_finds(ticks, axes, candidates, seed):
    rng = np.random.default_rng(seed)
    bins = np.unique(rng.integers(1, ticks // 2, 6))
    sent, seen = rng.standard_normal((candidates, axes, ticks)), rng.standard_normal((2, axes, ticks))
    seen[0] += sent[0]
    ours = mean_coherency(segment_spectra(sent, bins), segment_spectra(seen, bins))
    theirs = [[scipy_mean(one, other, bins) for other in seen] for one in sent]
    assert ours == pytest.approx(np.array(theirs), abs=1e-9)


def test_a_long_list_of_candidates_gives_the_same_as_one_by_one(monkeypatch):
    bins = np.arange(3, 20)
    sent, seen = RNG.standard_normal((7, 2, 200)), RNG.standard_normal((3, 2, 200))
    whole = mean_coherency(segment_spectra(sent, bins), segment_spectra(seen, bins))
    monkeypatch.setattr("mtm_audit.detectors.welch._CHUNK_VALUES", 2 * 17 * 3 * 2)
    parts = mean_coherency(segment_spectra(sent, bins), segment_spectra(seen, bins))
    assert parts == pytest.approx(whole, abs=1e-12)


def test_a_signal_is_coherent_with_its_gain_and_offset():
    x = RNG.standard_normal((1, 1, 300))
    bins = np.arange(3, 30)
    assert mean_coherency(segment_spectra(x, bins), segment_spectra(-2.5 * x + 7.0, bins)) == pytest.approx(1.0)


def test_a_body_that_stands_still_is_coherent_with_nothing():
    bins = np.arange(3, 30)
    still = segment_spectra(np.zeros((1, 1, 300)), bins)
    assert np.all(still == 0.0)
    assert mean_coherency(segment_spectra(RNG.standard_normal((4, 1, 300)), bins), still) == pytest.approx(0.0)


@pytest.mark.parametrize(("ticks", "length"), [(48, 24), (49, 24), (255, 127), (256, 128), (5000, 128)])
def test_segments_are_as_long_as_the_paper_says(ticks, length):
    assert segment_length(ticks) == length


def test_each_bin_counts_in_proportion_to_its_power():
    bins, powers = np.array([3, 5, 11]), np.array([0.2, 0.7, 2.1])
    sent, seen = RNG.standard_normal((4, 2, 300)), RNG.standard_normal((3, 2, 300))
    by_bin = [
        mean_coherency(segment_spectra(sent, bins[[place]]), segment_spectra(seen, bins[[place]])) for place in range(3)
    ]
    found = mean_coherency(segment_spectra(sent, bins), segment_spectra(seen, bins), powers)
    assert found == pytest.approx(np.einsum("k,kcr->cr", powers / 3.0, by_bin))
    plain = mean_coherency(segment_spectra(sent, bins), segment_spectra(seen, bins))
    assert np.array_equal(mean_coherency(segment_spectra(sent, bins), segment_spectra(seen, bins), np.ones(3)), plain)
