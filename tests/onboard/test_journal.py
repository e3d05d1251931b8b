import errno
from pathlib import Path

import pytest

from mtm_onboard.guard import CLAMPED, NOISE
from mtm_onboard.journal import Journal, JournalHeader, read_journal
from mtm_onboard.motion import BodyVelocity
from mtm_onboard.protocol import MtmError

HEADER = JournalHeader("0123456789abcdef", "fake-key", "robot0", "a", (0, 3, 1), True, 50.0, 10.0, 1.7e9)
BASE, SENT = BodyVelocity(0.1, -0.2, 0.3), BodyVelocity(0.15, -0.25, 1 / 3)


class FillingDisk:
    """A file on a disk that takes no byte between two of them."""

    def __init__(self, path: Path, full_from: int, full_until: int) -> None:
        self._file = path.open("wb", buffering=0)
        self._asked, self._full = 0, (full_from, full_until)
        self.closed = False

    def write(self, data: bytes) -> int:
        begin, self._asked = self._asked, self._asked + len(data)
        if not self._full[0] <= begin < self._full[1]:
            part = data[: max(0, self._full[0] - begin)] if begin < self._full[0] else data
            return self._file.write(part)
        raise OSError(errno.ENOSPC, "No space left on device")

    def close(self) -> None:
        self.closed = True
        self._file.close()


def write(journal: Journal, ticks) -> None:
    for tick in ticks:
        journal.append(tick, 10.0 + tick / 50.0 + 0.003, BASE, SENT, NOISE | CLAMPED)


@pytest.mark.parametrize("threaded", [False, True])
def test_what_was_written_is_read_back(tmp_path, threaded):
    with Journal(tmp_path / "a.csv", HEADER, threaded=threaded) as journal:
        write(journal, range(-5, 1200))
    record = read_journal(journal.path)
    assert record.header == HEADER
    assert record.ticks.tolist() == list(range(-5, 1200))
    assert record.times_s == pytest.approx(10.003 + record.ticks / 50.0)
    assert record.base[7] == pytest.approx(BASE)
    assert record.sent[7] == pytest.approx(SENT)
    assert record.lateness_s == pytest.approx(0.003)
    assert set(record.flags) == {NOISE | CLAMPED}
    assert (record.damaged, journal.lost) == (0, 0)


def test_a_journal_without_ticks_and_without_a_message_is_read_back(tmp_path):
    header = JournalHeader("0123456789abcdef", "fake-key", "robot0", "a", None, True, 50.0, 0.0, None)
    with Journal(tmp_path / "a.csv", header, threaded=False) as journal:
        pass
    record = read_journal(journal.path)
    assert record.header == header
    assert (record.ticks.shape, record.sent.shape) == ((0,), (0, 3))


def test_an_existing_journal_is_kept(tmp_path):
    paths = []
    for count in range(3):
        with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
            write(journal, range(count))
        paths.append(journal.path)
    assert [path.name for path in paths] == ["a.csv", "a-2.csv", "a-3.csv"]
    assert [len(read_journal(path).ticks) for path in paths] == [0, 1, 2]


def test_a_disk_that_is_full_for_a_while_costs_rows_that_are_counted(tmp_path):
    path = tmp_path / "a.csv"
    journal = Journal(path, HEADER, threaded=False)
    vars(journal)["_file"].close()
    vars(journal)["_file"] = FillingDisk(path, 60_000, 150_000)
    with Journal(tmp_path / "header.csv", HEADER, threaded=False):
        pass
    vars(journal)["_file"].write((tmp_path / "header.csv").read_bytes())
    write(journal, range(4000))
    journal.close()
    record = read_journal(path)
    assert 0 < journal.lost < 4000
    assert len(record.ticks) + journal.lost == 4000
    assert record.damaged == 1  # the row that the full disk cut in two
    assert record.ticks[-1] == 3999


def test_a_crash_in_the_middle_of_a_row_costs_that_row(tmp_path):
    with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
        write(journal, range(10))
    journal.path.write_bytes(journal.path.read_bytes()[:-5])
    record = read_journal(journal.path)
    assert record.ticks.tolist() == list(range(9))
    assert record.damaged == 1


def test_a_writer_that_stands_still_holds_up_no_tick_and_fills_no_memory(tmp_path, monkeypatch):
    monkeypatch.setattr("mtm_onboard.journal._MOST_WAITING", 100)
    monkeypatch.setattr("mtm_onboard.journal._WRITE_PERIOD_S", 1e6)
    with Journal(tmp_path / "a.csv", HEADER, threaded=True) as journal:
        write(journal, range(250))
        assert journal.lost == 150
    assert read_journal(journal.path).ticks.tolist() == list(range(100))


def test_what_is_no_journal_and_where_none_can_be_are_refused(tmp_path):
    (tmp_path / "other.csv").write_text("tick,time\n1,2\n")
    with pytest.raises(MtmError, match="does not begin like a journal"):
        read_journal(tmp_path / "other.csv")
    with pytest.raises(MtmError, match="check the name"):
        read_journal(tmp_path / "none.csv")
    with pytest.raises(MtmError, match="choose a folder"):
        Journal(tmp_path / "none" / "a.csv", HEADER, threaded=False)
