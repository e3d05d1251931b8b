import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy import stats

from mtm_audit.significance.decoys import compare, decoy_codebooks, weigh_log_evidence, weigh_mean_of_maxima
from tests.audit.moving_robot import OTHER_SECRET, key_of, scheme_of

KEY = key_of(scheme_of())


def null_strengths(rng, shape, maxima, candidates=8):
    """Means of `maxima` maxima over candidates: what strengths are when there is no message."""
    return rng.standard_normal((*shape, maxima, candidates)).max(axis=-1).mean(axis=-1)


@pytest.mark.parametrize("maxima", [1, 4, 16])
@pytest.mark.parametrize("decoys", [12, 40])
def test_without_a_message_p_values_are_nearly_uniform(maxima, decoys):
    rng = np.random.default_rng([maxima, decoys])
    draws = null_strengths(rng, (800, decoys + 1), maxima)
    p_values = np.array([weigh_mean_of_maxima(row[0], row[1:], maxima).p_value for row in draws])
    # The skew is the Gumbel limit's, which maxima of eight normals have not reached; p must never be too small.
    assert stats.kstest(p_values, "uniform").statistic < 0.1
    for level in (0.05, 0.01):
        assert np.mean(p_values < level) < 1.5 * level + 2.0 * np.sqrt(level / len(p_values))


def test_p_values_of_gumbel_means_are_never_too_small():
    rng = np.random.default_rng(3)
    for maxima in (1, 4):
        draws = rng.gumbel(size=(1000, 41, maxima)).mean(axis=-1)
        p_values = np.array([weigh_mean_of_maxima(row[0], row[1:], maxima).p_value for row in draws])
        assert stats.kstest(p_values, "uniform").statistic < 0.06
        assert np.mean(p_values < 0.01) < 0.02


@given(shift=st.floats(-60.0, 60.0), more=st.floats(0.1, 5.0), maxima=st.integers(1, 20), seed=st.integers(0, 50))
@example(shift=-1.75, more=0.25, maxima=1, seed=0)
def test_more_strength_never_makes_the_evidence_weaker(shift, more, maxima, seed):
    decoys = np.random.default_rng(seed).standard_normal(20)
    assert (
        weigh_mean_of_maxima(shift + more, decoys, maxima).p_value
        <= weigh_mean_of_maxima(shift, decoys, maxima).p_value
    )


@given(gain=st.floats(0.01, 100.0), offset=st.floats(-10.0, 10.0), strength=st.floats(-2.0, 6.0))
def test_the_unit_of_the_strength_does_not_matter(gain, offset, strength):
    decoys = np.random.default_rng(4).standard_normal(20)
    plain = weigh_mean_of_maxima(strength, decoys, 4).p_value
    assert weigh_mean_of_maxima(gain * strength + offset, gain * decoys + offset, 4).p_value == pytest.approx(
        plain, rel=1e-6
    )


def test_few_decoys_promise_less():
    decoys = np.random.default_rng(4).standard_normal(40)
    decoys = (decoys - decoys.mean()) / decoys.std(ddof=1)
    few = (decoys[:8] - decoys[:8].mean()) / decoys[:8].std(ddof=1)
    assert weigh_mean_of_maxima(6.0, few, 4).p_value > 20 * weigh_mean_of_maxima(6.0, decoys, 4).p_value


def test_every_decode_of_a_key_meets_the_same_decoys():
    channel = KEY.scheme.channels[0]
    first, again = decoy_codebooks(KEY, 3), decoy_codebooks(KEY, 3)
    for one, other in zip(first, again, strict=True):
        assert np.array_equal(one.samples(channel, 0), other.samples(channel, 0))
    assert len({codebook.samples(channel, 0).tobytes() for codebook in first}) == 3


def test_no_decoy_is_the_key_s_or_another_key_s_decoy():
    channel = KEY.scheme.channels[0]
    others = decoy_codebooks(key_of(KEY.scheme, OTHER_SECRET), 40)
    waveforms = [codebook.samples(channel, 0) for codebook in [KEY.codebook(), *decoy_codebooks(KEY, 40), *others]]
    rows = np.concatenate([table.reshape(len(table), -1) for table in waveforms])
    likeness = np.corrcoef(rows) - np.eye(len(rows))
    assert np.abs(likeness).max() < 0.95


def test_decoys_play_the_key_s_epoch():
    key = key_of(scheme_of(epoch=7))
    assert {codebook.scheme.epoch for codebook in decoy_codebooks(key, 3)} == {7}


@pytest.mark.parametrize("law", ["exponential", "normal", "gumbel", "uniform"])
def test_p_values_of_log_evidence_are_uniform_or_cautious(law):
    generator = np.random.default_rng(11)
    draws = getattr(generator, law)(size=(4000, 41))
    p_values = np.array([weigh_log_evidence(row[0], row[1:]).p_value for row in draws])
    for level in (0.5, 0.2, 0.1):
        assert abs(np.mean(p_values <= level) - level) < 0.03
    assert np.mean(p_values <= 0.01) < 0.016
    assert np.mean(p_values <= 0.001) < 0.003


@given(st.floats(-50, 50), st.floats(0.001, 20), st.integers(8, 60))
def test_more_evidence_is_never_less_convincing(strength, more, count):
    decoys = np.random.default_rng(5).gumbel(size=count)
    weak, strong = (weigh_log_evidence(value, decoys).p_value for value in (strength, strength + more))
    assert 0.0 < strong <= weak <= 1.0


def test_each_law_of_strengths_is_compared_in_its_own_way():
    strengths = np.random.default_rng(6).normal(size=13)
    by_maxima, by_evidence = (compare(strengths, law, 4) for law in ("mean of maxima", "log evidence"))
    assert by_maxima.p_value == weigh_mean_of_maxima(strengths[0], strengths[1:], 4).p_value
    assert by_evidence.p_value == weigh_log_evidence(strengths[0], strengths[1:]).p_value
    for comparison in (by_maxima, by_evidence):
        assert comparison.strength == strengths[0]
        assert np.array_equal(comparison.decoy_strengths, strengths[1:])
