import pytest
from scipy.stats import binom

from hil.experiments.runs.intervals import clopper_pearson


@pytest.mark.parametrize(
    ("successes", "trials", "percent"), [(20, 20, (83.2, 100.0)), (80, 80, (95.5, 100.0)), (0, 20, (0.0, 16.8))]
)
def test_the_intervals_of_perfect_runs_are_the_paper_s(successes, trials, percent):
    low, high = clopper_pearson(successes, trials)
    assert (100 * low, 100 * high) == pytest.approx(percent, abs=0.05)


def test_each_end_leaves_two_and_a_half_percent_outside():
    low, high = clopper_pearson(7, 30)
    assert binom.sf(6, 30, low) == pytest.approx(0.025)
    assert binom.cdf(7, 30, high) == pytest.approx(0.025)


@pytest.mark.parametrize(("successes", "trials"), [(3, 2), (-1, 2), (0, 0)])
def test_impossible_counts_are_refused(successes, trials):
    with pytest.raises(ValueError, match=r"k|n"):
        clopper_pearson(successes, trials)
