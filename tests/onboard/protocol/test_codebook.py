from unittest.mock import patch

import numpy as np
import pytest

from mtm_onboard.protocol import Channel, Codebook, MtmError, Scheme
from mtm_onboard.protocol import codebook as module

FAKE_SECRET = b"not a real secret, only for test"


def scheme(**changes):
    plain = dict(
        name="test", rate_hz=50.0, band_hz=(0.5, 5.0), alphabet_size=4, message_ticks=600,
        channels=(Channel("a", "a", ("vx", "vy"), 1, 0.1), Channel("b", "b", ("vx",), 3, 0.1)),
    )  # fmt: skip
    return Scheme(**(plain | changes))


def test_channels_may_have_different_symbols_windows_and_axes():
    book = Codebook(FAKE_SECRET, scheme())
    a, b = book.scheme.channels
    assert book.samples(a, 0).shape == (4, 2, 600)
    assert book.samples(b, 2).shape == (4, 1, 200)


def test_asking_for_symbol_40000_derives_no_other():
    book = Codebook(FAKE_SECRET, scheme(alphabet_size=65_536))
    with patch.object(module, "draw_tones", wraps=module.draw_tones) as draw:
        book.samples(book.scheme.channels[0], 0, [40_000])
    assert draw.call_count == 2  # one a axis


def test_no_two_waveforms_of_a_codebook_are_alike():
    book = Codebook(FAKE_SECRET, scheme())
    a, b = book.scheme.channels
    tones = np.concatenate([book.samples(a, 0).reshape(-1, 600)[:, :200], book.samples(b, 0).reshape(-1, 200)])
    correlation = np.corrcoef(tones)
    assert np.max(np.abs(correlation - np.eye(len(correlation)))) < 0.9


def test_a_fixed_schedule_repeats_and_a_rolling_one_never_does():
    fixed, rolling = Codebook(FAKE_SECRET, scheme()), Codebook(FAKE_SECRET, scheme(schedule="rolling"))
    channel = fixed.scheme.channels[1]
    assert np.array_equal(fixed.tones(channel, 0), fixed.tones(channel, 7))
    assert not np.allclose(rolling.tones(channel, 0), rolling.tones(channel, 7))
    assert np.array_equal(fixed.tones(channel, 0), rolling.tones(channel, 0))


def test_epochs_and_keys_share_no_waveform():
    channel = scheme().channels[0]
    books = [Codebook(FAKE_SECRET, scheme()), Codebook(FAKE_SECRET, scheme(), epoch=1), Codebook(bytes(32), scheme())]
    first = [book.tones(channel, 0) for book in books]
    assert not np.allclose(first[0], first[1])
    assert not np.allclose(first[0], first[2])


def test_a_symbol_outside_the_alphabet_and_a_short_secret_are_refused():
    book = Codebook(FAKE_SECRET, scheme())
    with pytest.raises(MtmError, match="choose 0 to 3"):
        book.tones(book.scheme.channels[0], 0, [4])
    with pytest.raises(MtmError, match="32 bytes"):
        Codebook(b"short", scheme())


def test_the_secret_is_in_no_repr():
    assert "real" not in repr(Codebook(FAKE_SECRET, scheme()))
