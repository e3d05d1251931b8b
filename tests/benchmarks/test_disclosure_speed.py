"""Time to verify a disclosed day; `make bench` shows it."""

import hashlib
import time
from collections.abc import Callable
from datetime import UTC, date, datetime, timedelta
from statistics import median

from mtm_onboard.protocol.disclosure import anchor_of, disclosed_key
from mtm_onboard.protocol.key import generate_master
from mtm_onboard.protocol.public_channel import carried_key
from tests.onboard.schemes import small_scheme

FIRST, DAYS = date(2026, 1, 1), 365
MASTER = generate_master("fake-fleet", small_scheme(schedule="rolling"), FIRST, DAYS)
LAST = FIRST + timedelta(DAYS - 1)
ANCHOR, KEY = anchor_of(MASTER), disclosed_key(MASTER, LAST, datetime(2028, 1, 1, tzinfo=UTC))


def test_a_year_s_chain_is_verified_in_about_a_millisecond(benchmark):
    assert benchmark(ANCHOR.verified, KEY) is KEY


def test_a_carried_key_s_day_is_found_as_fast(benchmark):
    found = benchmark(carried_key, ANCHOR, KEY.holding.link, LAST + timedelta(1))
    assert found.holding.grant.first_day == LAST


def bare_chain() -> bytes:
    """As many hashes of as many bytes, and nothing else."""
    link = bytes(32)
    for _ in range(DAYS):
        link = hashlib.shake_256(link + bytes(21)).digest(32)
    return link


def median_ns(work: Callable[[], object]) -> float:
    times_ns = []
    for _ in range(50):
        begun_ns = time.thread_time_ns()
        work()
        times_ns.append(time.thread_time_ns() - begun_ns)
    return median(times_ns)


def test_a_year_s_chain_costs_little_more_than_its_hashes(capsys):
    """A hash takes about a microsecond: at ten times as long for each, a year takes 4 ms of the 50 that are allowed."""
    bare_ns, whole_ns = median_ns(bare_chain), median_ns(lambda: ANCHOR.verified(KEY))
    with capsys.disabled():
        print(f"\na year's chain {whole_ns / 1e6:.2f} ms, {whole_ns / bare_ns:.1f} times its hashes alone")
    assert whole_ns < 10.0 * bare_ns
