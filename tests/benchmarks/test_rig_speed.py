"""How much faster than real time four robots run on one core; `make bench` shows it as `times_real_time`."""

import pytest

from hil.fleet.lockstep import run_lockstep
from tests.hil.fleet.short_runs import fake_key, short_run

SECONDS = 10.0


@pytest.mark.parametrize(("wire", "at_least"), [("can", 5.0), ("plaintext", 5.0), ("direct", 100.0)])
def test_four_robots_run_faster_than_real_time(benchmark, wire, at_least):
    settings = short_run(key=fake_key(600), seconds=SECONDS, wire=wire)
    benchmark.pedantic(run_lockstep, args=(settings,), rounds=5, warmup_rounds=1)
    if benchmark.enabled:
        ratio = SECONDS / benchmark.stats.stats.min
        benchmark.extra_info["times_real_time"] = round(ratio, 1)
        print(f"\n{wire}: {ratio:.1f} times real time")
        assert ratio >= at_least
