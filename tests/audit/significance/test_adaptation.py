"""Responses and interference that positions learn from others."""

import numpy as np
import pytest

from mtm_audit.significance.adaptation import Seen, adapted
from mtm_audit.significance.likelihood import log_e_of

TONES, GROUPS = 10, 6
EVERY_OTHER = ~np.eye(GROUPS, dtype=bool)


def waveforms(rng, *shape):
    """Tones (..., 1, 2 K) of the law `ensemble`."""
    return rng.standard_normal((*shape, 1, 2 * TONES)) / np.sqrt(TONES)


def observed(rng, sent, gains, size, noise=1.0):
    """What groups show of `sent` tones that come through with complex `gains` (K,), under one hypothesis."""
    quadratic = np.full((1, GROUPS, 1, TONES), size)
    tones = sent[..., :TONES] + 1j * sent[..., TONES:]
    errors = rng.standard_normal((2, *quadratic.shape))
    linear = quadratic * gains * tones[None] + noise * np.sqrt(quadratic) * (errors[0] + 1j * errors[1])
    return Seen(linear, quadratic)


def plain(seen):
    linear = np.concatenate([seen.linear.real, seen.linear.imag], axis=-1)
    return linear, np.concatenate([seen.quadratic, seen.quadratic], axis=-1)


def evidence(weights, sent):
    return log_e_of(*weights, sent[:, None], "ensemble")[0, :, 0]


def test_without_others_a_group_keeps_its_weights():
    rng = np.random.default_rng(0)
    sent = waveforms(rng, GROUPS)
    seen = observed(rng, sent, np.ones(TONES), 20.0)
    nobody = np.zeros((GROUPS, GROUPS), dtype=bool)
    for found, expected in zip(adapted(seen, sent, nobody, np.arange(GROUPS)), plain(seen), strict=True):
        assert found == pytest.approx(expected)


def test_a_notch_that_no_plant_of_the_family_has_is_learned():
    rng = np.random.default_rng(1)
    sent = waveforms(rng, GROUPS)
    gains = np.where(np.arange(TONES) < 5, 1.2 * np.exp(1j * np.linspace(0.5, -2.0, TONES)), 0.05)
    seen = observed(rng, sent, gains, 40.0)
    learned = evidence(adapted(seen, sent, EVERY_OTHER, np.arange(GROUPS)), sent)
    assert learned.sum() > evidence(plain(seen), sent).sum() + 30.0


def test_interference_taken_for_too_loud_is_found_to_be_quieter():
    """As where it was fitted to motion that holds the message."""
    rng = np.random.default_rng(2)
    sent = waveforms(rng, GROUPS)
    seen = observed(rng, sent, np.ones(TONES), 10.0, noise=0.4)
    learned = evidence(adapted(seen, sent, EVERY_OTHER, np.arange(GROUPS)), sent)
    assert learned.sum() > 1.3 * evidence(plain(seen), sent).sum()


@pytest.mark.parametrize("size", [1.0, 30.0])
def test_over_keys_the_mean_is_one_whatever_was_learned(size):
    rng = np.random.default_rng(3)
    sent = waveforms(rng, GROUPS)
    seen = observed(rng, sent, np.full(TONES, 0.5 - 0.5j), size)
    linear, quadratic = adapted(seen, sent, EVERY_OTHER, np.arange(GROUPS))
    # Small weights, so that the mean is not made by a few keys that are never drawn.
    shrunk = 1.0 / np.sqrt(np.maximum(np.sum(linear**2, axis=-1, keepdims=True) / TONES, 1.0))
    keys = waveforms(rng, GROUPS, 40_000)
    values = np.exp(log_e_of(shrunk * linear, quadratic, keys, "ensemble")[0])
    assert np.all(np.abs(values.mean(axis=1) - 1.0) < 5.0 * values.std(axis=1) / np.sqrt(values.shape[1]))


def test_a_group_that_nobody_saw_teaches_nothing():
    rng = np.random.default_rng(4)
    sent = waveforms(rng, GROUPS)
    seen = observed(rng, sent, np.ones(TONES), 20.0)
    seen.linear[:, 2], seen.quadratic[:, 2] = 0.0, 0.0
    linear, quadratic = adapted(seen, sent, EVERY_OTHER, np.arange(GROUPS))
    assert np.all(np.isfinite(linear))
    assert np.all(linear[:, 2] == 0.0)
    assert np.all(quadratic[:, 2] == 0.0)
    without = EVERY_OTHER & (np.arange(GROUPS) != 2)
    assert adapted(seen, sent, without, np.arange(GROUPS))[0][:, 0] == pytest.approx(linear[:, 0])
