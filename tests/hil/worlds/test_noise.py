import numpy as np
import pytest

from hil.worlds.noise import keyed_noise, white_noise
from hil.worlds.schemes import same_scheme, single_scheme, split_scheme
from mtm_onboard.protocol import Codebook

SECRET = b"not a real secret, only for test"
AXES = ("agent.vx", "agent.vy")


def test_each_message_plays_its_symbols_at_the_amplitude():
    scheme = same_scheme("discovery", 8, 60, 1)
    codebook = Codebook(SECRET, scheme)
    noise = keyed_noise(codebook, [(3,), (5,)], AXES)
    expected = 0.03 * codebook.samples(scheme.channels[0], 0, [3, 5])
    assert noise == pytest.approx(np.concatenate(expected.transpose(0, 2, 1)))


def test_an_axis_that_no_channel_uses_stays_still():
    scheme = single_scheme("discovery", "y", 8, 60, 1)
    noise = keyed_noise(Codebook(SECRET, scheme), [(0,)], AXES)
    assert np.all(noise[:, 0] == 0.0)
    assert np.std(noise[:, 1]) == pytest.approx(0.03)


def test_channels_that_split_a_message_play_their_own_parts():
    scheme = split_scheme("lunar-lander", 4, 576, (2, 3))
    codebook = Codebook(SECRET, scheme)
    noise = keyed_noise(codebook, [(0, 1, 2, 3, 0)], ("lander.vx", "lander.vy"))
    side, main = scheme.channels
    assert noise[288:, 0] == pytest.approx(0.5 * codebook.samples(side, 0, [1])[0, 0])
    assert noise[192:384, 1] == pytest.approx(0.5 * codebook.samples(main, 0, [3])[0, 0])


def test_white_noise_has_the_scheme_s_amplitude_on_its_axes():
    scheme = single_scheme("reacher", "outer", 8, 240, 1)
    noise = white_noise(scheme, 4000, ("arm.inner", "arm.outer"), np.random.default_rng(0))
    assert np.all(noise[:, 0] == 0.0)
    assert np.std(noise[:, 1]) == pytest.approx(1.0, abs=0.05)
