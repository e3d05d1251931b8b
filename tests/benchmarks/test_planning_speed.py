"""How much faster the exact split search is than trying every allocation, and how long a large one takes."""

import itertools
import time

import numpy as np
import pytest

from mtm_audit.planning.allocation import best_log_accuracies
from mtm_audit.planning.plan import Problem
from mtm_audit.planning.search import families, frontier, search
from mtm_audit.planning.table import AccuracyPoint, AccuracyTable

pytestmark = pytest.mark.benchmark(timer=time.process_time)


def processor_s(function, *arguments, repeats):
    """Processor time of one call, the best of `repeats`, and its result."""
    times_s = []
    for _ in range(repeats):
        start_s = time.process_time()
        result = function(*arguments)
        times_s.append(time.process_time() - start_s)
    return min(times_s), result


def by_trying_everything(logs, symbols, lengths):
    """The best log accuracy of each message length, of all allocations one by one."""
    allocations = [counts for counts in itertools.product(range(symbols), repeat=len(logs)) if sum(counts) == symbols]
    return np.array([max(log_accuracy(logs, counts, int(ticks)) for counts in allocations) for ticks in lengths])


def log_accuracy(logs, counts, ticks):
    total = 0.0
    for log, count in zip(logs, counts, strict=True):
        if count:
            window, rest = divmod(ticks, count)
            if rest or window >= len(log):
                return -np.inf
            total += count * log[window]
    return total


def table_of(channels, alphabet_sizes, windows, trials=800):
    """Channels of different strength, measured every 30 ticks."""
    generator = np.random.default_rng(3)
    points = []
    for channel in range(channels):
        scale = generator.uniform(40.0, 120.0)
        for alphabet in alphabet_sizes:
            for ticks in 30 * np.arange(1, windows + 1):
                accuracy = 1.0 - (1.0 - 1.0 / alphabet) * np.exp(-ticks / scale)
                right = int(generator.binomial(trials, accuracy))
                points.append(AccuracyPoint(f"c{channel}", alphabet, int(ticks), right, trials))
    return AccuracyTable(tuple(points))


def test_dynamic_programming_is_fifty_times_faster_than_trying(capsys):
    generator = np.random.default_rng(1)
    logs = [np.log(generator.uniform(0.5, 1.0, 121)) for _ in range(5)]
    lengths = np.arange(12, 240)
    slow_s, expected = processor_s(by_trying_everything, logs, 12, lengths, repeats=1)
    fast_s, found = processor_s(best_log_accuracies, logs, 12, lengths, repeats=5)
    with capsys.disabled():
        print(
            f"\n5 channels, 12 symbols, {len(lengths)} message lengths: {slow_s:.2f} s trying everything, "
            f"{1000 * fast_s:.1f} ms by dynamic programming, {slow_s / fast_s:.0f} times faster"
        )
    assert found == pytest.approx(expected)
    assert slow_s / fast_s >= 50.0


@pytest.mark.parametrize("measured_only", [False, True])
def test_eight_channels_and_64_symbols_take_two_seconds(capsys, measured_only):
    table = table_of(channels=8, alphabet_sizes=(2, 4, 8), windows=20)
    # 64 bits are 64 symbols of M = 2.
    seconds, found = processor_s(search, table, Problem(64, 0.9, measured_only=measured_only), repeats=2)
    _, found_binary = processor_s(search, table, Problem(64, 0.9, (2,), measured_only), repeats=1)
    split = found_binary[2].plan
    with capsys.disabled():
        print(
            f"\n8 channels, up to 64 symbols, 3 x 20 table, {'measured' if measured_only else 'all'} windows: "
            f"{seconds:.2f} s; split M = {found[2].plan.alphabet_size}, T = {found[2].plan.message_ticks}"
        )
    assert split.exact
    assert split.symbols == 64
    assert seconds < 2.0


def test_the_longest_scan_takes_two_seconds_as_well(capsys):
    # Nothing short of the longest windows would do, so that every message length is tried.
    table = table_of(channels=8, alphabet_sizes=(2, 4, 8), windows=20)
    lengths_s, _ = processor_s(_whole_frontier, table, repeats=1)
    with capsys.disabled():
        print(f"\n8 channels, 64 symbols, 3 x 20 table, all message lengths: {lengths_s:.2f} s")
    assert lengths_s < 2.0


def _whole_frontier(table):
    return [frontier(family) for family in families(table, Problem(64, 0.9)) if family.strategy == "split"]
