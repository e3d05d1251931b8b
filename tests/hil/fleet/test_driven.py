import numpy as np
import pytest

from hil.fleet.driven import sent_track
from hil.fleet.sending import Sending
from hil.worlds.vehicles import VEHICLES
from mtm_onboard.runtime.modulator import Modulator
from tests.audit.moving_robot import key_of, scheme_of

KEY = key_of(scheme_of(symbols=(2,), ticks=200))
CHANNEL = KEY.scheme.channels[0]


def sending(**changes):
    given = dict(codebook=KEY.codebook(), channel=CHANNEL, symbols=(3, 1), onset_s=0.5, messages=1, sigma=0.1)
    return Sending(**{**given, **changes})


def test_the_noise_is_that_of_the_onboard_modulator():
    times_s = np.arange(0, 450) * 0.01
    noise = sending().noise(times_s)
    modulator = Modulator(KEY.codebook(), CHANNEL.name, (3, 1))
    assert np.all(noise[:50] == 0.0)
    for tick in (0, 1, 99, 100, 199):
        for held in (0, 1):
            assert noise[50 + 2 * tick + held] == pytest.approx(0.1 * modulator.perturbation(tick))
    assert np.all(noise[450:] == 0.0)


def test_a_message_played_again_begins_anew():
    times_s = np.arange(0, 900) * 0.01
    again = sending(messages=3).noise(times_s)
    assert np.array_equal(again[50:450], again[450:850])
    assert np.array_equal(sending(messages=3, onset_s=-4.0).noise(times_s)[:400], again[50:450])


def test_a_fast_clock_shortens_the_message():
    times_s = np.arange(0, 450) * 0.01
    assert np.flatnonzero(sending(rate_scale=1.25, onset_s=0.0).noise(times_s)[:, 0])[-1] == 319


@pytest.mark.parametrize("name", list(VEHICLES))
def test_every_vehicle_shows_its_noise_and_repeats_itself(name):
    vehicle = VEHICLES[name]
    quiet = sent_track("robot0", vehicle, [], 6.0, np.random.default_rng(1))
    loud = sent_track("robot0", vehicle, [sending()], 6.0, np.random.default_rng(1))
    assert quiet.positions.shape == (601, 2)
    assert (quiet.headings_rad is None) == (name == "arm")
    assert np.allclose(quiet.positions[:40], loud.positions[:40])
    assert np.abs(quiet.positions - loud.positions)[60:].max() > 0.005
    again = sent_track("robot0", vehicle, [], 6.0, np.random.default_rng(1))
    assert np.array_equal(again.positions, quiet.positions)
