import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.planning.allocation import best_allocation, best_log_accuracies
from mtm_audit.planning.bycapacity import SplitByCapacity
from mtm_audit.planning.curve import fit_curve
from mtm_audit.planning.family import Split
from mtm_audit.planning.table import AccuracyPoint

LOGS = st.lists(st.floats(-3.0, 0.0) | st.just(-np.inf), min_size=2, max_size=40).map(
    lambda values: np.array([-np.inf, *values])
)


def every_allocation(channels, symbols):
    """All ways to share the symbols out over two channels or more."""
    for counts in itertools.product(range(symbols), repeat=channels):
        if sum(counts) == symbols:
            yield counts


def log_accuracy(logs, counts, ticks):
    total = 0.0
    for log, count in zip(logs, counts, strict=True):
        if count:
            window, rest = divmod(ticks, count)
            if rest or window >= len(log):
                return -np.inf
            total += count * log[window]
    return total


@given(st.lists(LOGS, min_size=2, max_size=4), st.integers(2, 6))
def test_the_search_finds_what_trying_everything_finds(logs, symbols):
    lengths = np.arange(1, 130)
    found = best_log_accuracies(logs, symbols, lengths)
    for ticks, value in zip(lengths.tolist(), found.tolist(), strict=True):
        best = max(log_accuracy(logs, counts, ticks) for counts in every_allocation(len(logs), symbols))
        assert value == pytest.approx(best)
        if np.isfinite(value):
            counts = best_allocation(logs, symbols, ticks)
            assert sum(counts) == symbols
            assert log_accuracy(logs, counts, ticks) == pytest.approx(best)


def curves(*scales, alphabet=4):
    """Channels whose error falls to 1/e in so many ticks, measured without noise every 10 ticks up to 400."""
    found = []
    for number, scale in enumerate(scales):
        errors = [(1.0 - 1.0 / alphabet) * np.exp(-ticks / scale) for ticks in range(10, 401, 10)]
        points = [
            AccuracyPoint(f"c{number}", alphabet, 10 * place, round((1.0 - error) * 10**6), 10**6)
            for place, error in enumerate(errors, 1)
        ]
        found.append(fit_curve(points, measured_only=False))
    return tuple(found)


def first_reaching(family, accuracy):
    for lengths, logs in family.lengths():
        reaching = np.flatnonzero(logs >= np.log(accuracy))
        if len(reaching):
            return int(lengths[reaching[0]])
    return None


def test_equal_channels_share_equally_and_stronger_carry_more():
    equal, unequal = Split(4, curves(20.0, 20.0), 8), Split(4, curves(15.0, 30.0), 9)
    assert [count for _, count in equal.parts(first_reaching(equal, 0.9))] == [4, 4]
    strong, weak = (count for _, count in unequal.parts(first_reaching(unequal, 0.9)))
    assert strong > weak


def test_sharing_by_capacity_costs_little_time():
    for scales in ((20.0, 20.0), (12.0, 30.0), (10.0, 15.0, 40.0)):
        exact, heuristic = Split(4, curves(*scales), 60), SplitByCapacity(4, curves(*scales), 60)
        ticks = first_reaching(heuristic, 0.9)
        assert sum(count for _, count in heuristic.parts(ticks)) >= 60
        assert ticks <= 1.2 * first_reaching(exact, 0.9)
