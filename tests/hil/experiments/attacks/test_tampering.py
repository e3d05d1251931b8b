"""Each attack's own part, on commands that are known; no simulator is needed."""

import numpy as np
import pytest

from hil.experiments.attacks import desynchronisation, jamming, prediction
from hil.experiments.attacks.additive_noise import with_white_noise
from hil.experiments.attacks.band_stop import without_band
from hil.experiments.attacks.codebook_learning import mean_windows
from hil.experiments.attacks.driving import SCHEME, SIGMA_MPS, band_noise, codebook_of, goals_of, noise_of
from hil.experiments.attacks.foretelling import fitted, lagged, share_foretold
from hil.experiments.attacks.noise_replacement import replacing
from hil.experiments.attacks.prediction import Foreteller, floor_mps
from hil.experiments.attacks.steganalysis import band_powers, ranked_higher
from hil.experiments.attacks.whitening import whitening, whitening_weights
from hil.worlds.discovery import Tick
from mtm_onboard.protocol.waveform import channel_tones

ROLLOUTS, TICKS = 3, 960


@pytest.fixture(scope="module")
def noise():
    """(rollouts, ticks, 2): keyed noise of three rollouts."""
    return np.stack([noise_of(codebook_of(seed), goals_of(seed)) for seed in range(ROLLOUTS)])


def played(tamper, noise, base_mps=0.5):
    """(rollouts, ticks, 2): what reaches the motors of an agent that is told to go ahead at one speed."""
    base = np.full((len(noise), 2), base_mps)
    position = np.zeros((len(noise), 2))
    sent = []
    for tick in range(noise.shape[1]):
        sent.append(np.array(tamper(Tick(tick, base, base + noise[:, tick], position))))
        position = position + 0.1 * sent[-1]
    return np.stack(sent, axis=1)


def in_band_share(series):
    """Share of the power between 1 and 2 Hz."""
    power = np.abs(np.fft.rfft(series - series.mean(axis=1, keepdims=True), axis=1)) ** 2
    hz = np.fft.rfftfreq(series.shape[1], 0.1)
    return power[:, (hz > 0.95) & (hz < 2.05)].sum() / power.sum()


def test_added_noise_has_the_strength_that_was_asked_for(noise):
    sent = played(with_white_noise(0.2, np.random.default_rng(1)), noise)
    assert np.std(sent - 0.5 - noise) == pytest.approx(0.2, rel=0.05)


def test_a_band_stop_takes_the_band_and_leaves_the_course(noise):
    sent = played(without_band((1.0, 2.0), 4), noise)
    assert np.array_equal(played(without_band((1.0, 2.0), 0), noise), 0.5 + noise)
    late = sent[:, 300:]
    assert np.std(late) < 0.4 * np.std(noise)
    assert late.mean() == pytest.approx(0.5, abs=0.01)


def test_replaced_noise_is_as_loud_and_no_longer_keyed(noise):
    fresh = band_noise(noise.shape, np.random.default_rng(2))
    half, whole = (played(replacing(share, fresh.transpose(1, 0, 2)), noise) - 0.5 for share in (0.5, 1.0))
    assert np.std(half) == pytest.approx(SIGMA_MPS, rel=0.1)
    assert np.allclose(whole, fresh)
    assert abs(np.corrcoef(whole.ravel(), noise.ravel())[0, 1]) < 0.1


def test_whitened_noise_fills_the_spectrum_as_loud_as_before(noise):
    weights = whitening_weights(noise, 16)
    sent = played(whitening(weights, ROLLOUTS), noise) - 0.5
    assert in_band_share(noise) > 0.95
    assert in_band_share(sent[:, 100:]) < 0.6
    assert np.std(sent) == pytest.approx(SIGMA_MPS, rel=0.3)


@pytest.mark.parametrize(("latency", "least", "most"), [(0, 0.9, 1.0), (30, -0.1, 0.4)])
def test_the_noise_of_known_commands_is_foretold_while_recent(noise, monkeypatch, latency, least, most):
    monkeypatch.setattr(prediction, "overheard", lambda scheme: (noise, noise, noise))
    weights = prediction.learnt_weights(prediction.COMMANDS, latency)
    foreteller = Foreteller(weights, latency, prediction.COMMANDS, ROLLOUTS, np.random.default_rng(3))
    other = np.stack([noise_of(codebook_of(seed), goals_of(seed)) for seed in range(50, 50 + ROLLOUTS)])
    sent = played(foreteller, other) - 0.5
    assert least < foreteller.share < most
    assert np.mean(sent**2) == pytest.approx((1.0 - foreteller.share) * np.mean(other**2))


def test_a_white_floor_has_the_density_that_was_asked_for():
    # The band is a fifth of the spectrum: the same density in all of it is five times the power.
    assert floor_mps(0.0) ** 2 == pytest.approx(5.0 * SIGMA_MPS**2)
    assert floor_mps(-10.0) ** 2 == pytest.approx(0.5 * SIGMA_MPS**2)


@pytest.mark.parametrize("below_db", [-10.0, -5.0])
def test_a_keyed_floor_is_a_spectrum_of_the_same_power(below_db):
    scheme = prediction.floored_scheme(below_db)
    tones_hz, powers = channel_tones(scheme, scheme.channels[0])
    inside = (tones_hz >= SCHEME.band_hz[0]) & (tones_hz <= SCHEME.band_hz[1])
    # All tones that ten ticks a second and twelve seconds can have.
    assert len(tones_hz) == 59
    assert 10.0 * np.log10(powers[~inside] / powers[inside][0]) == pytest.approx(below_db)
    assert powers.mean() == pytest.approx(1.0)
    played_mps = noise_of(codebook_of(3, scheme), goals_of(3))
    assert np.std(played_mps) == pytest.approx(SIGMA_MPS, rel=0.1)


@pytest.mark.parametrize(("below_db", "most"), [(-10.0, 0.55), (-5.0, 0.25)])
def test_less_is_foretold_of_noise_with_a_keyed_floor(monkeypatch, below_db, most):
    scheme = prediction.floored_scheme(below_db)
    noise = np.stack([noise_of(codebook_of(seed, scheme), goals_of(seed)) for seed in range(ROLLOUTS)])
    monkeypatch.setattr(prediction, "overheard", lambda asked: (noise, noise, noise) if asked == scheme else None)
    weights = prediction.learnt_weights(prediction.COMMANDS, 0, scheme=scheme)
    foreteller = Foreteller(weights, 0, prediction.COMMANDS, ROLLOUTS, np.random.default_rng(3))
    other = np.stack([noise_of(codebook_of(seed, scheme), goals_of(seed)) for seed in range(50, 50 + ROLLOUTS)])
    played(foreteller, other)
    assert 0.0 < foreteller.share < most


def test_a_network_learns_what_can_be_learnt_of_its_inputs():
    draw = np.random.default_rng(4)
    inputs = draw.standard_normal((4000, 2 * 20))
    noise = 0.03 * np.stack([np.tanh(inputs[:, 0]), inputs[:, 1] - inputs[:, 3]], axis=1)
    network = jamming.Network(inputs[:3000], noise[:3000])
    assert share_foretold(noise[3000:], network(inputs[3000:])) > 0.95


def test_a_delay_holds_back_and_moves_between_ticks():
    steps = np.arange(8.0)[None, :, None] * np.ones((1, 8, 2))
    delays = np.full((8, 1), 2.0)
    assert np.allclose(played(desynchronisation.delayed(delays), steps, 0.0)[0, :, 0], [0, 0, 0, 1, 2, 3, 4, 5])
    halfway = played(desynchronisation.delayed(np.full((8, 1), 0.5)), steps, 0.0)[0, 1:, 0]
    assert np.allclose(halfway, np.arange(1, 8) - 0.5)


def test_warps_and_slips_keep_within_their_bounds():
    assert desynchronisation.warp(4.0, 2).min() == 0.0
    assert desynchronisation.warp(4.0, 2).max() == pytest.approx(4.0)
    delays = desynchronisation.slips(120.0, 2, np.random.default_rng(5))
    assert (delays.min(), delays.max()) == (0.0, 20.0)
    assert set(np.unique(np.diff(delays, axis=0))) <= {-1.0, 0.0, 1.0}
    assert not desynchronisation.slips(0.0, 2, np.random.default_rng(5)).any()


def test_lags_are_of_the_past_alone():
    series = np.arange(1.0, 6.0)[None]
    assert np.allclose(lagged(series, range(2))[0], [[1, 0], [2, 1], [3, 2], [4, 3], [5, 4]])
    weights = fitted(np.eye(3), np.array([1.0, 2.0, 3.0]))
    assert np.allclose(weights, [1.0, 2.0, 3.0], rtol=1e-4)


def test_mean_windows_are_sorted_by_symbol_and_as_loud_as_noise(noise):
    goals = np.array([goals_of(seed) for seed in range(ROLLOUTS)])
    book = codebook_of(7)
    same_key = np.stack([noise_of(book, own) for own in goals])
    learnt = mean_windows(same_key, goals)
    truth = noise_of(book, np.arange(8)).reshape(8, -1, 2)
    assert np.allclose(np.sqrt(np.mean(learnt**2, axis=(1, 2))), SIGMA_MPS)
    inner = slice(20, 100)
    for symbol in range(8):
        fit = [abs(np.corrcoef(learnt[symbol, inner].ravel(), other[inner].ravel())[0, 1]) for other in truth]
        assert int(np.argmax(fit)) == symbol


def test_what_is_told_of_a_delay_is_its_line_in_each_window():
    ticks = np.arange(TICKS) / 100.0 + 2.0
    means, lines = desynchronisation.delays_told(ticks).values()
    # Ten ticks a second, 120 ticks a window.
    assert np.allclose(lines[1], [0.32, 0.01])
    assert np.allclose(means[1], [0.3795, 0.0])


def test_windows_in_another_order_each_time_are_told_by_likeness(noise):
    """What is learnt has the order of the first rollout, whatever the later ones were said to say."""
    goals = np.array([goals_of(seed) for seed in range(ROLLOUTS)])
    orders = np.array([np.roll(np.arange(8), number) for number in (3, 5, 6)])
    book = codebook_of(7)
    played = np.stack([noise_of(book, order[own]) for order, own in zip(orders, goals, strict=True)])
    learnt = mean_windows(played, goals, by_likeness=True)
    truth = noise_of(book, np.arange(8)).reshape(8, -1, 2)
    inner = slice(20, 100)
    for symbol in range(8):
        fit = [abs(np.corrcoef(learnt[symbol, inner].ravel(), other[inner].ravel())[0, 1]) for other in truth]
        assert int(np.argmax(fit)) == orders[0, symbol]


def test_a_discriminant_tells_noise_from_none_not_from_itself():
    draw = np.random.default_rng(6)
    quiet, loud, louder = (scale * draw.standard_normal((200, 64, 2)) for scale in (1.0, 2.0, 2.0))
    pairs, higher = ranked_higher(band_powers(loud), band_powers(quiet))
    assert (pairs, higher) == (100, 100)
    assert 30 < ranked_higher(band_powers(loud), band_powers(louder))[1] < 70
