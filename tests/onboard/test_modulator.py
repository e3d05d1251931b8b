from unittest.mock import patch

import numpy as np
import pytest

from mtm_onboard.modulator import Modulator
from mtm_onboard.motion import BodyVelocity
from mtm_onboard.protocol import Channel, MtmError
from tests.onboard.schemes import small_codebook

BASE = BodyVelocity(0.3, -0.1, 0.5)


def played(modulator: Modulator, ticks) -> np.ndarray:
    rows = []
    for tick in ticks:
        rows.append(modulator.perturbation(tick).copy())
        modulator.prepare(tick)
    return np.array(rows)


def test_the_message_is_its_symbols_waveforms_one_after_the_other():
    book = small_codebook()
    channel = book.scheme.channel("b")
    expected = np.concatenate([book.samples(channel, window, [symbol])[0].T for window, symbol in enumerate((3, 0, 2))])
    assert np.array_equal(played(Modulator(book, "b", (3, 0, 2)), range(120)), expected)


def test_a_repeated_message_starts_again_and_one_that_is_not_ends_in_silence():
    again = Modulator(small_codebook(), "b", (3, 0, 2))
    once = Modulator(small_codebook(), "b", (3, 0, 2), repeat=False)
    assert np.array_equal(played(again, range(120, 240)), played(again, range(120)))
    assert np.array_equal(played(once, range(120)), played(again, range(120)))
    assert not played(once, range(120, 400)).any()
    assert [tick for tick in range(-3, 200) if once.sends(tick)] == list(range(120))


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_before_the_message_there_is_silence(schedule):
    modulator = Modulator(small_codebook(schedule=schedule), "a", (1,))
    assert not played(modulator, range(-130, 0)).any()
    assert modulator.add(-1, BASE) == BASE


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_ticks_that_never_come_shift_nothing(schedule):
    whole = played(Modulator(small_codebook(schedule=schedule), "b", (3, 0, 2)), range(1200))
    kept = np.flatnonzero(np.random.default_rng(1).random(1200) < 0.3)
    # A stall over more than a window as well.
    kept = kept[(kept < 300) | (kept > 430)].tolist()
    assert np.array_equal(played(Modulator(small_codebook(schedule=schedule), "b", (3, 0, 2)), kept), whole[kept])


def test_a_rolling_schedule_plays_no_window_twice_while_the_symbols_repeat():
    book = small_codebook(schedule="rolling")
    windows = played(Modulator(book, "b", (3, 0, 2)), range(40 * 30)).reshape(30, 40)
    correlation = np.corrcoef(windows)
    assert np.max(np.abs(correlation - np.eye(30))) < 0.95
    assert np.array_equal(windows[7], book.samples(book.scheme.channel("b"), 7, [0])[0, 0])


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_nothing_is_derived_in_the_tick_that_sends(schedule):
    book = small_codebook(schedule=schedule)
    modulator = Modulator(book, "b", (3, 0, 2))
    for tick in range(400):
        with patch.object(book, "samples", side_effect=AssertionError("derived while sending")):
            modulator.add(tick, BASE)
            modulator.perturbation(tick)
        modulator.prepare(tick)


def test_a_perturbation_is_a_view_that_nobody_can_write_to():
    modulator = Modulator(small_codebook(), "a", (1,))
    noise = modulator.perturbation(5)
    assert np.shares_memory(noise, modulator.perturbation(5))
    with pytest.raises(ValueError, match="read-only"):
        noise[0] = 1.0


def test_added_noise_has_the_scheme_s_sigma_on_the_channel_s_axes_alone():
    modulator = Modulator(small_codebook(), "a", (1,))
    sent = np.array([modulator.add(tick, BASE) for tick in range(120)])
    noise = np.array([modulator.perturbation(tick) for tick in range(120)])
    assert sent[:, :2] - BASE[:2] == pytest.approx(0.1 * noise)
    assert np.all(sent[:, 2] == BASE.wz_radps)
    assert np.sqrt(np.mean((sent[:, :2] - BASE[:2]) ** 2, axis=0)) == pytest.approx([0.1, 0.1])


def test_a_gaussian_policy_takes_the_keyed_noise_for_its_own():
    modulator = Modulator(small_codebook(), "a", (1,))
    mean, sigma = np.array([0.2, -0.4]), np.array([0.5, 2.0])
    assert modulator.substitute(7, mean, sigma) == pytest.approx(mean + sigma * modulator.perturbation(7))


def test_a_channel_of_joints_serves_a_policy_but_no_body_velocity():
    book = small_codebook(channels=(Channel("arm", "arm", ("shoulder", "elbow"), 1, 0.1),))
    modulator = Modulator(book, "arm", (1,))
    assert modulator.substitute(3, np.zeros(2), 1.0) == pytest.approx(modulator.perturbation(3))
    with pytest.raises(MtmError, match="shoulder, elbow"):
        modulator.add(3, BASE)


def test_a_wrong_channel_and_wrong_symbols_are_refused():
    with pytest.raises(MtmError, match="no channel 'c'"):
        Modulator(small_codebook(), "c", (1,))
    with pytest.raises(MtmError, match="sends 3 symbols a message, not 1"):
        Modulator(small_codebook(), "b", (1,))
    with pytest.raises(MtmError, match="choose 0 to 3"):
        Modulator(small_codebook(), "a", (4,))
