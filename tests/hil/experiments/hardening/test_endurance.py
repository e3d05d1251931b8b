import pytest

from hil.experiments.hardening.endurance import SYMBOLS, endure
from mtm_onboard.protocol import MtmError


@pytest.fixture(scope="module")
def run():
    """Two minutes around midnight; the journal may keep 480 kB, which is less than it is given."""
    return endure(120.0, 2, 0, lambda _: None, detector="coherency", journal_bytes=480_000)


def test_there_is_a_tick_for_each_period_and_none_is_disturbed(run):
    assert [(one.elapsed_s, one.ticks) for one in run] == [(60.0, 3000), (120.0, 6000)]
    assert [(one.missed, one.disturbed, one.faults) for one in run] == [(0, 0, 0), (0, 0, 0)]


def test_the_message_is_read_across_midnight_and_at_the_end(run):
    assert [one.symbols_right for one in run] == [len(SYMBOLS)] * 2
    assert all(one.p_value < 0.01 for one in run)


def test_the_journal_keeps_to_its_bounds_and_the_memory_is_flat(run):
    assert all(0 < one.journal_bytes <= 480_000 and one.journal_lost == 0 for one in run)
    assert run[1].resident_bytes - run[0].resident_bytes < 2_000_000


def test_checkpoints_whose_films_would_overlap_are_refused():
    with pytest.raises(MtmError, match="fewer"):
        endure(100.0, 2, 0, lambda _: None)
