from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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
    with patch.object(module, "draw_alphabet", wraps=module.draw_alphabet) as draw:
        book.samples(book.scheme.channels[0], 0, [40_000])
    assert [call.args[3:5] for call in draw.call_args_list] == [([40_000], range(2))]


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
    books = [Codebook(FAKE_SECRET, scheme()), Codebook(FAKE_SECRET, scheme(epoch=1)), Codebook(bytes(32), scheme())]
    first = [book.tones(channel, 0) for book in books]
    assert not np.allclose(first[0], first[1])
    assert not np.allclose(first[0], first[2])


@given(st.integers(0, 10**8), st.integers(0, 40), st.sampled_from([600, 4_950]))
def test_counting_from_another_slot_gives_the_same_waveforms(first_slot, window, message_ticks):
    rolling = scheme(schedule="rolling", message_ticks=message_ticks)
    channel = rolling.channels[1]
    absolute = first_slot * channel.symbols + window
    later, whole = Codebook(FAKE_SECRET, rolling, first_slot), Codebook(FAKE_SECRET, rolling)
    assert np.array_equal(later.tones(channel, window, [2]), whole.tones(channel, absolute, [2]))


def test_each_day_begins_an_epoch_whose_windows_count_from_zero():
    # 7,200 messages of 12 s fill a day.
    today = Codebook(FAKE_SECRET, scheme(schedule="rolling", epoch=5), first_slot=7_200)
    tomorrow_as_epoch = Codebook(FAKE_SECRET, scheme(schedule="rolling", epoch=6))
    for channel in today.scheme.channels:
        for window in range(-2, 4):
            if window >= 0:
                assert np.array_equal(today.tones(channel, window), tomorrow_as_epoch.tones(channel, window))
            else:
                assert not np.allclose(today.tones(channel, window), tomorrow_as_epoch.tones(channel, 0))


def test_only_a_rolling_window_before_1970_is_refused():
    book = Codebook(FAKE_SECRET, scheme(schedule="rolling"), first_slot=2)
    channel = book.scheme.channels[1]
    book.tones(channel, -6, [0])
    with pytest.raises(MtmError, match="set the clock"):
        book.tones(channel, -7, [0])
    fixed = Codebook(FAKE_SECRET, scheme(), first_slot=2)
    assert np.array_equal(fixed.tones(channel, -7), fixed.tones(channel, 0))


def test_a_wrong_symbol_and_a_short_secret_are_refused():
    book = Codebook(FAKE_SECRET, scheme())
    with pytest.raises(MtmError, match="choose 0 to 3"):
        book.tones(book.scheme.channels[0], 0, [4])
    with pytest.raises(MtmError, match="32 bytes"):
        Codebook(b"short", scheme())


def test_the_secret_is_in_no_repr():
    assert "real" not in repr(Codebook(FAKE_SECRET, scheme()))
