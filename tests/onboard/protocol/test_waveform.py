"""The waveform against values computed independently (OpenSSL and 200-bit arithmetic), and its statistics."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol.keystream import stream
from mtm_onboard.protocol.scheme import count_bins, shortest_window
from mtm_onboard.protocol.waveform import (
    draw_alphabet,
    draw_tones,
    evaluate,
    evaluate_window,
    phasors,
    tone_basis,
    tone_bins,
)

VECTORS = json.loads((Path(__file__).parent / "waveform_v1.json").read_text())


@pytest.mark.parametrize("vector", VECTORS, ids=lambda v: f"n{v['window_ticks']}-{v['symbol']}-{v['power']}")
def test_waveform_agrees_with_the_independent_reference_to_1e_12(vector):
    secret, place = bytes.fromhex(vector["key_hex"]), [vector[name] for name in ("epoch", "window", "symbol", "axis")]
    band_hz = (float(vector["band_hz"][0]), float(vector["band_hz"][1]))
    bins = tone_bins(vector["window_ticks"], float(vector["rate_hz"]), band_hz)
    assert stream(secret, "symbol", tuple(place), 16).hex() == vector["stream_first_16_hex"]
    assert bins.tolist() == vector["bins"]
    amplitudes, phases_rad = draw_tones(secret, *place, len(bins))
    np.testing.assert_allclose(amplitudes, np.array(vector["amplitudes"], float), rtol=0, atol=1e-12)
    np.testing.assert_allclose(phases_rad, np.array(vector["phases_rad"], float), rtol=0, atol=1e-12)
    ticks = np.arange(vector["window_ticks"])
    samples = evaluate(phasors(amplitudes, phases_rad, vector["power"]), bins, vector["window_ticks"], ticks)
    np.testing.assert_allclose(samples, np.array(vector["samples"], float), rtol=0, atol=1e-12)


def test_an_instant_between_two_ticks_lies_on_the_same_formula():
    bins = tone_bins(100, 50.0, (0.5, 5.0))
    tones = phasors(*draw_tones(bytes(32), 0, 0, 3, 0, len(bins)), "ensemble")
    whole = evaluate(tones, bins, 100, np.arange(100))
    np.testing.assert_allclose(evaluate(tones, bins, 100, np.arange(100) + 0.0), whole, atol=1e-12)
    halves = evaluate(tones, bins, 100, np.arange(200) / 2)
    np.testing.assert_allclose(halves[::2], whole, atol=1e-12)


def test_ensemble_power_gives_unit_normal_samples_over_keys():
    from scipy import stats

    bins = tone_bins(60, 50.0, (0.5, 5.0))
    draws = [
        evaluate(
            phasors(*draw_tones(number.to_bytes(32, "big"), 0, 0, 0, 0, len(bins)), "ensemble"),
            bins,
            60,
            np.array([17]),
        )
        for number in range(4000)
    ]
    assert stats.kstest(np.ravel(draws), "norm").pvalue > 1e-3


@given(symbol=st.integers(0, 65_535), ticks=st.integers(25, 700))
def test_window_power_gives_every_window_mean_square_one(symbol, ticks):
    bins = tone_bins(ticks, 50.0, (0.5, 5.0))
    samples = evaluate(
        phasors(*draw_tones(bytes(32), 0, 0, symbol, 0, len(bins)), "window"), bins, ticks, np.arange(ticks)
    )
    assert np.mean(samples**2) == pytest.approx(1.0, abs=1e-9)


@given(
    ticks=st.integers(1, 2000),
    rate_hz=st.floats(1, 200),
    low=st.floats(0.001, 0.4),
    width=st.floats(0.001, 0.4),
)
def test_bins_are_those_of_the_definition(ticks, rate_hz, low, width):
    band_hz = (low * rate_hz, min(low + width, 0.499) * rate_hz)
    definition = [k for k in range(1, ticks) if k < ticks / 2 and band_hz[0] <= k * rate_hz / ticks <= band_hz[1]]
    assert tone_bins(ticks, rate_hz, band_hz).tolist() == definition
    assert count_bins(ticks, rate_hz, band_hz) == len(definition)


@given(rate_hz=st.floats(5, 100), low=st.floats(0.01, 0.3), width=st.floats(0.01, 0.15))
def test_the_shortest_window_has_two_tones_and_none_shorter_has(rate_hz, low, width):
    band_hz = (low * rate_hz, (low + width) * rate_hz)
    shortest = shortest_window(rate_hz, band_hz)
    assert shortest is not None
    assert count_bins(shortest, rate_hz, band_hz) >= 2
    assert all(count_bins(ticks, rate_hz, band_hz) < 2 for ticks in range(1, shortest))


def test_streams_of_different_labels_and_places_share_nothing():
    streams = {
        stream(bytes(32), label, place, 16) for label in ("symbol", "tag") for place in ((0, 1), (1, 0), (0,), ())
    }
    assert len(streams) == 8


def test_a_stream_refuses_what_it_cannot_encode():
    with pytest.raises(ValueError, match="32 bytes"):
        stream(b"short", "symbol", (), 8)
    with pytest.raises(ValueError, match="64-bit"):
        stream(bytes(32), "symbol", (-1,), 8)
    with pytest.raises(ValueError, match="255"):
        stream(bytes(32), "", (), 8)


@pytest.mark.parametrize(("ticks", "bins"), [(10, [1, 2, 3, 4]), (11, [1, 2, 3, 4, 5]), (2, []), (1, [])])
def test_no_bin_reaches_half_the_rate_whatever_the_band(ticks, bins):
    assert tone_bins(ticks, 50.0, (1.0, 1000.0)).tolist() == bins


def test_bins_are_shared_and_nobody_can_write_to_them():
    with pytest.raises(ValueError, match="read-only"):
        tone_bins(20, 50.0, (2.0, 20.0))[0] = 3


@given(st.integers(5, 400), st.integers(0, 100), st.sampled_from(["window", "ensemble"]))
def test_a_whole_window_is_the_formula_at_its_ticks(ticks, symbol, power):
    bins = tone_bins(ticks, 50.0, (2.0, 24.0))
    tones = phasors(*draw_tones(bytes(32), 0, 0, symbol, 0, len(bins)), power)
    formula = evaluate(tones, bins, ticks, np.arange(ticks))
    np.testing.assert_allclose(evaluate_window(tones, bins, ticks), formula, rtol=0, atol=1e-12)


def test_a_late_tick_has_the_phase_of_its_place_in_the_window():
    bins = tone_bins(100, 50.0, (0.5, 5.0))
    late = 100 * 10**12
    assert np.array_equal(tone_basis(bins, 100, np.array([late + 7])), tone_basis(bins, 100, np.array([7])))


def test_a_stream_of_zeros_is_the_loudest_tone_there_is(monkeypatch):
    monkeypatch.setattr("mtm_onboard.protocol.waveform.streams", lambda *asked: bytes(asked[-1]))
    amplitudes, phases_rad = draw_tones(bytes(32), 0, 0, 0, 0, 3)
    # The middle of the first of 2 ** 53 steps.
    assert amplitudes == pytest.approx([np.sqrt(2.0 * 54.0 * np.log(2.0))] * 3)
    assert phases_rad.tolist() == [0.0] * 3


def test_an_alphabet_drawn_at_once_is_each_symbol_by_itself():
    symbols, axes = (7, 0, 65_535), (1, 2)
    amplitudes, phases_rad = draw_alphabet(bytes(32), 3, 11, symbols, axes, 13)
    for row, symbol in enumerate(symbols):
        for column, axis in enumerate(axes):
            alone = draw_tones(bytes(32), 3, 11, symbol, axis, 13)
            assert np.array_equal([amplitudes[row, column], phases_rad[row, column]], alone)


def test_many_windows_at_once_are_each_window_by_itself():
    bins = tone_bins(50, 50.0, (2.0, 20.0))
    drawn = [[draw_tones(bytes(32), 0, 0, symbol, axis, len(bins)) for axis in range(3)] for symbol in range(2)]
    amplitudes, phases_rad = (np.array([[axis[part] for axis in row] for row in drawn]) for part in (0, 1))
    together = evaluate_window(phasors(amplitudes, phases_rad, "window"), bins, 50)
    assert together.shape == (2, 3, 50)
    for symbol in range(2):
        for axis in range(3):
            alone = phasors(amplitudes[symbol, axis], phases_rad[symbol, axis], "window")
            np.testing.assert_allclose(together[symbol, axis], evaluate_window(alone, bins, 50), atol=1e-12)
