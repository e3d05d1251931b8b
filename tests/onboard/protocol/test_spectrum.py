"""The spectrum: waveforms against an independent reference, its laws over keys, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from mtm_onboard.protocol import Channel, Codebook, MtmError
from mtm_onboard.protocol.scheme import scheme_from_table
from mtm_onboard.protocol.schemefile import load_scheme, save_scheme
from mtm_onboard.protocol.spectrum import MAX_POINTS, MAX_RANGE_DB, tone_powers
from mtm_onboard.protocol.waveform import channel_tones, draw_tones, evaluate, phasors, tone_bins
from tests.onboard.schemes import small_codebook, small_scheme

VECTORS = json.loads((Path(__file__).parent / "waveform_spectrum_v1.json").read_text())
SLOPE = ((2.0, 0.0), (20.0, -12.0))
POINTS = st.lists(
    st.tuples(st.floats(0.0, 25.0), st.floats(-30.0, 30.0)), min_size=2, max_size=8, unique_by=lambda point: point[0]
).map(lambda points: tuple(sorted(points)))


def book_of(vector):
    axes = ("a", "b", "c")[: vector["axis"] + 1]
    scheme = small_scheme(
        rate_hz=float(vector["rate_hz"]), band_hz=tuple(map(float, vector["band_hz"])), alphabet_size=512,
        message_ticks=vector["window_ticks"], channels=(Channel("robot", "robot", axes, 1, 0.1),),
        power=vector["power"], schedule="rolling" if vector["window"] else "fixed", epoch=vector["epoch"],
        spectrum=tuple((float(hz), float(db)) for hz, db in vector["spectrum"]),
    )  # fmt: skip
    return Codebook(bytes.fromhex(vector["key_hex"]), scheme)


@pytest.mark.parametrize("vector", VECTORS, ids=lambda v: f"n{v['window_ticks']}-{v['symbol']}-{v['power']}")
def test_waveforms_agree_with_the_reference_to_1e_12(vector):
    book = book_of(vector)
    (channel,) = book.scheme.channels
    assert book.bins(channel).tolist() == vector["bins"]
    np.testing.assert_allclose(book.tone_powers(channel), np.array(vector["powers"], float), rtol=1e-13)
    played = book.samples(channel, vector["window"], [vector["symbol"]])[0, vector["axis"]]
    np.testing.assert_allclose(played, np.array(vector["samples"], float), rtol=0, atol=1e-12)


@given(POINTS, st.integers(2, 60))
def test_powers_are_positive_and_of_mean_one(points, count):
    powers = tone_powers(points, np.linspace(0.5, 24.0, count))
    assert powers.mean() == pytest.approx(1.0)
    assert powers.min() > 0.0


@given(POINTS, st.floats(-4000.0, 4000.0))
def test_only_differences_of_levels_count(points, offset_db):
    moved = tuple((hz, db + offset_db) for hz, db in points)
    tones_hz = np.linspace(0.5, 24.0, 17)
    assert tone_powers(moved, tones_hz) == pytest.approx(tone_powers(points, tones_hz), rel=1e-6)


def test_the_most_that_a_spectrum_may_hold_is_taken():
    many = tuple((float(hz), 0.0) for hz in range(MAX_POINTS))
    for points in (many, ((0.0, 0.0), (1e6, 0.0)), ((1.0, 0.0), (2.0, -MAX_RANGE_DB))):
        assert small_scheme(spectrum=points).spectrum == points


def test_levels_follow_the_line_and_stay_beyond_the_points():
    powers = tone_powers(((2.0, 0.0), (4.0, -20.0)), np.array([1.0, 2.0, 3.0, 4.0, 9.0]))
    assert powers / powers[0] == pytest.approx([1.0, 1.0, 0.1, 0.01, 0.01])


@pytest.mark.parametrize("power", ["ensemble", "window"])
def test_a_flat_spectrum_of_points_plays_what_none_plays(power):
    flat, none = (small_codebook(power=power, spectrum=points) for points in (((0.0, 3.0), (25.0, 3.0)), None))
    channel = none.scheme.channels[0]
    np.testing.assert_allclose(flat.samples(channel, 0), none.samples(channel, 0), rtol=0, atol=1e-12)


@pytest.mark.parametrize("power", ["ensemble", "window"])
def test_without_a_spectrum_every_bit_is_as_before(power):
    book = small_codebook(power=power)
    channel, bins = book.scheme.channels[0], tone_bins(120, 50.0, (2.0, 20.0))
    amplitudes, phases_rad = (np.array(part) for part in zip(
        *(draw_tones(b"not a real secret, only for test", 0, 0, 2, axis, len(bins)) for axis in (0, 1)), strict=True
    ))  # fmt: skip
    assert np.array_equal(book.tones(channel, 0, [2])[0], phasors(amplitudes, phases_rad, power))


def test_ensemble_samples_stay_unit_normal_over_keys():
    scheme = small_scheme(power="ensemble", spectrum=SLOPE)
    channel = scheme.channels[0]
    draws = [Codebook(number.to_bytes(32, "big"), scheme).samples(channel, 0, [0])[0, 0, 17] for number in range(4000)]
    assert stats.kstest(draws, "norm").pvalue > 1e-3


@pytest.mark.parametrize("power", ["ensemble", "window"])
def test_power_is_one_on_average_and_each_tone_has_its_share(power):
    scheme = small_scheme(alphabet_size=4096, power=power, spectrum=SLOPE)
    channel = scheme.channels[0]
    book = Codebook(bytes(32), scheme)
    tones = book.tones(channel, 0)[:, 0]
    means = (np.abs(tones) ** 2 / 2.0).mean(axis=0) * tones.shape[1]
    # Each tone's power is nearly exponential: its mean over 4096 has an error of a 64th, of which 4.5 is one in 1e5.
    assert means / book.tone_powers(channel) == pytest.approx(np.ones(len(means)), abs=4.5 / 64.0)
    squares = np.mean(book.samples(channel, 0)[:, 0] ** 2, axis=1)
    assert squares.mean() == pytest.approx(1.0, abs=4.5 * squares.std() / 64.0)


def test_without_a_spectrum_all_tones_are_alike_loud():
    tones_hz, powers = channel_tones(small_scheme(), small_scheme().channels[0])
    assert tones_hz == pytest.approx(tone_bins(120, 50.0, (2.0, 20.0)) / 2.4)
    assert powers.tolist() == [1.0] * len(tones_hz)


def test_window_power_spreads_less_than_the_ensemble_s():
    spreads = []
    for power in ("window", "ensemble"):
        scheme = small_scheme(alphabet_size=2000, power=power, spectrum=SLOPE)
        squares = np.mean(Codebook(bytes(32), scheme).samples(scheme.channels[0], 0) ** 2, axis=-1)
        spreads.append(squares.std())
    assert 0.0 < spreads[0] < 0.8 * spreads[1]


def test_each_window_length_shares_its_power_over_its_own_tones():
    scheme = small_scheme(spectrum=SLOPE)
    for channel in scheme.channels:
        tones_hz, powers = channel_tones(scheme, channel)
        assert len(tones_hz) == len(tone_bins(scheme.window_ticks(channel), 50.0, (2.0, 20.0)))
        assert powers.mean() == pytest.approx(1.0)
        assert 10.0 * np.log10(powers[-1] / powers[0]) == pytest.approx(-12.0 / 18.0 * np.ptp(tones_hz))


def test_an_instant_between_ticks_lies_on_the_same_formula():
    book = small_codebook(spectrum=SLOPE)
    channel = book.scheme.channels[0]
    tones, bins = book.tones(channel, 0, [1]), book.bins(channel)
    halves = evaluate(tones, bins, 120, np.arange(240) / 2.0)
    np.testing.assert_allclose(halves[..., ::2], book.samples(channel, 0, [1]), rtol=0, atol=1e-12)


def test_a_spectrum_is_part_of_the_fingerprint():
    prints = [small_scheme(spectrum=points).fingerprint for points in (None, SLOPE, ((2.0, 0.0), (20.0, -12.5)))]
    assert len(set(prints)) == 3
    assert prints[0] == "398bcbf7d247e261"


def test_a_scheme_file_keeps_the_spectrum(tmp_path):
    scheme = small_scheme(spectrum=((2.5, 0.1), (7.0, -3.0), (19.75, -1e-3)))
    save_scheme(scheme, tmp_path / "plan.toml")
    again = load_scheme(tmp_path / "plan.toml")
    assert (again, again.fingerprint) == (scheme, scheme.fingerprint)
    save_scheme(small_scheme(), tmp_path / "flat.toml")
    assert "spectrum" not in (tmp_path / "flat.toml").read_text()


@pytest.mark.parametrize(
    ("points", "says"),
    [
        ((), "has 0 points; give 2 to 64"),
        (((1.0, 0.0),), "has 1 points; give 2 to 64"),
        (tuple((float(hz), 0.0) for hz in range(MAX_POINTS + 1)), "has 65 points"),
        (((1.0, 0.0), (1.0, -3.0)), "do not rise"),
        (((2.0, 0.0), (1.0, -3.0)), "do not rise"),
        (((-1.0, 0.0), (1.0, -3.0)), "between 0 and"),
        (((1.0, 0.0), (2e6, -3.0)), "between 0 and"),
        (((1.0, 0.0), (2.0, 0.0), (2e6, -3.0)), "between 0 and"),
        (((1.0, 0.0), (2.0, -MAX_RANGE_DB - 0.5)), "span 60.5 dB; 60 dB at most"),
        (((1.0, 0.0), (2.0, float("nan"))), "holds nan"),
        (((1.0, 0.0), (float("inf"), 0.0)), "holds inf"),
        (((1.0, "loud"), (2.0, 0.0)), "holds 'loud'"),
        (((1.0, True), (2.0, 0.0)), "holds True"),
        (((1.0, 0.0, 0.0), (2.0, 0.0)), "must be points"),
        ("flat", "must be points"),
    ],
)
def test_what_is_no_spectrum_is_refused_in_one_sentence(points, says):
    with pytest.raises(MtmError, match=says):
        small_scheme(spectrum=points)


@pytest.mark.parametrize("value", [3, "flat", [1.0, 2.0], [[1.0]], [[1.0, 2.0, 3.0]], None])
def test_a_table_without_points_is_refused(value):
    table = {
        "version": 1, "name": "x", "rate_hz": 50.0, "band_hz": [2.0, 20.0], "alphabet_size": 4, "message_ticks": 120,
        "channels": [{"name": "a", "body": "a", "axes": ["vx"], "symbols": 1, "sigma": 0.1}], "spectrum": value,
    }  # fmt: skip
    with pytest.raises(MtmError, match=r"must be a list of points \[Hz, dB\]"):
        scheme_from_table(table)
