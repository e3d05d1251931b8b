import gc
from weakref import WeakKeyDictionary

import numpy as np
import pytest

from mtm_audit.detectors.matched import candidates as module
from mtm_audit.detectors.matched.candidates import LazyTones, WindowTones, stacked_tones
from mtm_onboard.protocol import Codebook
from tests.audit.moving_robot import key_of, scheme_of


def codebook_of(alphabet, schedule="rolling"):
    return key_of(scheme_of(symbols=(2,), ticks=200, alphabet=alphabet, schedule=schedule)).codebook()


def channel_of(codebook):
    return codebook.scheme.channels[0]


@pytest.fixture
def counted(monkeypatch):
    """Counts the symbols that a large alphabet, here of more than 8, derives in blocks of 5."""
    monkeypatch.setattr(module, "WHOLE", 8)
    monkeypatch.setattr(module, "_BLOCK", 5)
    monkeypatch.setattr(module, "_kept", WeakKeyDictionary())
    derived, tones_of = [], Codebook.tones

    def tones(self, channel, window, symbols=None):
        derived.append(symbols)
        return tones_of(self, channel, window, symbols)

    monkeypatch.setattr(Codebook, "tones", tones)
    return derived


def test_a_large_alphabet_s_tones_are_those_of_its_symbols(counted):
    large = codebook_of(12)
    whole = stacked_tones(large, channel_of(large), 1)
    tones = large.tones(channel_of(large), 1)
    assert whole == pytest.approx(np.concatenate([tones.real, -tones.imag], axis=-1), rel=1e-6)
    chosen = WindowTones(large, channel_of(large), 1).of(np.array([7, 3]))
    assert chosen == pytest.approx(np.concatenate([tones.real, tones.imag], axis=-1)[[7, 3]], rel=1e-6)


def test_chosen_symbols_are_derived_where_the_whole_is_not_kept(counted):
    large = codebook_of(12)
    tones = large.tones(channel_of(large), 1, [7, 3])
    counted.clear()
    chosen = WindowTones(large, channel_of(large), 1).of(np.array([7, 3]))
    assert counted == [[7, 3]]
    assert np.array_equal(chosen, np.concatenate([tones.real, tones.imag], axis=-1))
    stacked_tones(large, channel_of(large), 1)
    counted.clear()
    assert WindowTones(large, channel_of(large), 1).of(np.array([7, 3])) == pytest.approx(chosen, rel=1e-6)
    assert counted == []


def test_a_large_alphabet_is_derived_once_for_all_stages(counted):
    large = codebook_of(12, schedule="fixed")
    channel = channel_of(large)
    first = stacked_tones(large, channel, 0)
    assert [len(symbols) for symbols in counted] == [5, 5, 2]
    assert WindowTones(large, channel, 4).whole is first
    assert LazyTones(large, channel, 1)[0] is first
    assert len(counted) == 3


def test_what_is_over_budget_is_derived_again(counted, monkeypatch):
    large = codebook_of(12)
    channel = channel_of(large)
    monkeypatch.setattr(module, "_BUDGET_BYTES", 2 * stacked_tones(large, channel, 0).nbytes)
    tones = LazyTones(large, channel, 3)
    shown = [tones[number].copy() for number in (0, 1, 2)]
    assert len(module._kept[large]) == 2
    counted.clear()
    assert np.array_equal(tones[2], shown[2])
    assert counted == []
    assert np.array_equal(tones[0], shown[0])
    assert len(counted) == 3


def test_nothing_is_kept_of_a_codebook_that_is_gone(counted):
    large = codebook_of(12)
    stacked_tones(large, channel_of(large), 0)
    assert len(module._kept) == 1
    del large
    gc.collect()
    assert len(module._kept) == 0


def test_what_is_forgotten_is_derived_again(counted):
    large = codebook_of(12)
    first = stacked_tones(large, channel_of(large), 0)
    module.forget(large)
    module.forget(large)
    again = stacked_tones(large, channel_of(large), 0)
    assert again is not first
    assert np.array_equal(again, first)


def test_a_small_alphabet_s_windows_are_derived_once(counted):
    small = codebook_of(4)
    tones = LazyTones(small, channel_of(small), 2)
    assert tones[1] is tones[1]
    assert len(counted) == 1
    assert [len(window) for window in tones[0:2]] == [4, 4]
    with pytest.raises(IndexError):
        tones[2]
