import errno
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.journal.journal import Journal
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.journal_file import (
    CLAMPED,
    NOISE,
    UNSENT,
    Event,
    JournalHeader,
    heading,
    read_journal,
    segments,
)

HEADER = JournalHeader(
    fingerprint="0123456789abcdef",
    key_id="fake-key",
    robot="robot0",
    channel="a",
    symbols=(0, 3, 1),
    repeat=True,
    rate_hz=50.0,
    start_s=10.0,
    start_unix_s=1.7e9,
)
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

    def fileno(self) -> int:
        return self._file.fileno()

    def close(self) -> None:
        self.closed = True
        self._file.close()


def write(journal: Journal, ticks) -> None:
    for tick in ticks:
        journal.append(tick, 10.0 + tick / 50.0 + 0.003, BASE, SENT, NOISE | CLAMPED, 0.003)


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


def test_a_journal_without_ticks_or_message_is_read_back(tmp_path):
    header = JournalHeader(
        fingerprint="0123456789abcdef",
        key_id="fake-key",
        robot="robot0",
        channel="a",
        symbols=None,
        repeat=True,
        rate_hz=50.0,
        start_s=0.0,
        start_unix_s=None,
    )
    with Journal(tmp_path / "a.csv", header, threaded=False) as journal:
        pass
    record = read_journal(journal.path)
    assert record.header == header
    assert (record.ticks.shape, record.sent.shape) == ((0,), (0, 3))


def test_only_its_owner_reads_a_journal_and_its_segments(tmp_path):
    former = os.umask(0)
    try:
        with Journal(tmp_path / "a.csv", HEADER, threaded=False, max_bytes=100_000) as journal:
            write(journal, range(1000))
    finally:
        os.umask(former)
    modes = {path.stat().st_mode & 0o777 for path in segments(journal.path)}
    assert len(segments(journal.path)) > 1
    assert modes == {0o600}


def test_an_existing_journal_is_kept(tmp_path):
    paths = []
    for count in range(3):
        with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
            write(journal, range(count))
        paths.append(journal.path)
    assert [path.name for path in paths] == ["a.csv", "a-2.csv", "a-3.csv"]
    assert [len(read_journal(path).ticks) for path in paths] == [0, 1, 2]


def test_a_disk_full_for_a_while_costs_counted_rows(tmp_path):
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


@pytest.mark.parametrize("line", ["# {", "# [1]", '# {"tick": "a", "text": "b"}', "# ", "#", "# 7"])
def test_a_damaged_comment_is_counted_and_skipped(tmp_path, line):
    with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
        write(journal, range(10))
    journal.path.write_text(journal.path.read_text() + line + "\n")
    record = read_journal(journal.path)
    assert (record.header, record.ticks.tolist()) == (HEADER, list(range(10)))
    assert (record.damaged, record.events) == (1, ())


def test_a_writer_that_stands_still_holds_up_no_tick(tmp_path, monkeypatch):
    monkeypatch.setattr("mtm_onboard.journal.journal._MOST_WAITING", 100)
    monkeypatch.setattr("mtm_onboard.journal.journal._WRITE_PERIOD_S", 1e6)
    with Journal(tmp_path / "a.csv", HEADER, threaded=True) as journal:
        write(journal, range(250))
        assert journal.lost == 150
    assert read_journal(journal.path).ticks.tolist() == list(range(100))


def test_events_are_read_back_in_order_beside_the_rows(tmp_path):
    with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
        journal.note(-5, "link lost: cable, pulled\n# twice")
        write(journal, range(3))
        journal.note(3, "message changed to 0,1")
        write(journal, range(3, 6))
    record = read_journal(journal.path)
    assert record.events == (Event(-5, "link lost: cable, pulled\n# twice"), Event(3, "message changed to 0,1"))
    assert record.ticks.tolist() == list(range(6))
    assert record.damaged == 0


def total_bytes(path: Path) -> int:
    return sum(segment.stat().st_size for segment in segments(path))


def test_a_journal_within_its_bound_keeps_what_is_newest(tmp_path):
    with Journal(tmp_path / "a.csv", HEADER, threaded=False, max_bytes=1_000_000) as journal:
        journal.note(0, "message changed to 0,1")
        for first in range(0, 40_000, 500):
            write(journal, range(first, first + 500))
            assert total_bytes(journal.path) <= 1_000_000
    assert len(segments(journal.path)) == 8
    record = read_journal(journal.path)
    assert record.ticks.tolist() == list(range(40_000 - len(record.ticks), 40_000))
    assert total_bytes(journal.path) > 700_000
    assert (journal.lost, record.damaged, record.header) == (0, 0, HEADER)
    # The segment it was written to is gone, but each new one repeats it.
    assert record.events == (Event(0, "message changed to 0,1"),)


def test_old_segments_alone_are_not_mixed_with_a_new_run(tmp_path):
    (tmp_path / "a.csv.000001").write_bytes(heading(HEADER))
    with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
        write(journal, range(3))
    assert journal.path.name == "a-2.csv"


def test_a_journal_removed_under_way_goes_on_in_a_new_segment(tmp_path):
    with Journal(tmp_path / "a.csv", HEADER, threaded=False, max_bytes=1_000_000) as journal:
        journal.path.unlink()
        write(journal, range(3_000))
    ticks = read_journal(journal.path).ticks.tolist()
    assert ticks == list(range(3_000 - len(ticks), 3_000))
    assert ticks


def test_when_no_segment_can_be_begun_the_old_ones_stay(tmp_path, monkeypatch):
    journal = Journal(tmp_path / "a.csv", HEADER, threaded=False, max_bytes=1_000_000)

    def refuse(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("mtm_onboard.journal.journal.os.replace", refuse)
    write(journal, range(3_000))
    journal.close()
    record = read_journal(journal.path)
    assert 0 < journal.lost < 3_000
    assert record.ticks.tolist() == list(range(3_000 - journal.lost))
    assert total_bytes(journal.path) <= 125_000


CHILD = """
import os, resource, signal, sys
from pathlib import Path
from mtm_onboard.journal.journal import Journal
from tests.onboard.journal.test_journal import HEADER, write
"""


def child(code: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", CHILD + code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[3])


def test_a_disk_quota_costs_rows_and_not_the_process(tmp_path):
    done = child(
        "resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))\n"
        "journal = Journal(Path(sys.argv[1]), HEADER, threaded=False)\n"
        "write(journal, range(2000)); journal.close(); print(journal.lost)",
        tmp_path / "a.csv",
    )
    lost, record = int(done.stdout), read_journal(tmp_path / "a.csv")
    assert 0 < lost < 2000
    assert record.ticks.tolist() == list(range(2000 - lost))


def test_a_killed_process_leaves_what_it_had_written(tmp_path):
    done = child(
        "import time\n"
        "journal = Journal(Path(sys.argv[1]), HEADER, threaded=True)\n"
        "write(journal, range(100))\n"
        "while b'\\n99,' not in journal.path.read_bytes(): time.sleep(0.01)\n"
        "write(journal, range(100, 105)); os.kill(os.getpid(), signal.SIGKILL)",
        tmp_path / "a.csv",
    )
    assert done.returncode == -9
    record = read_journal(tmp_path / "a.csv")
    assert record.ticks.tolist()[:100] == list(range(100))
    assert record.damaged == 0


def test_the_disk_is_asked_to_confirm_each_second_and_at_the_end(tmp_path, monkeypatch):
    now_s, asked = [100.0], []
    monkeypatch.setattr("mtm_onboard.journal.journal.time.monotonic", lambda: now_s[0])
    monkeypatch.setattr("mtm_onboard.journal.journal.os.fsync", lambda descriptor: asked.append(now_s[0]))
    journal = Journal(tmp_path / "a.csv", HEADER, threaded=False)
    asked.clear()  # the folder's entry
    turns = iter([False] * 35 + [True])

    class Turns:
        def wait(self, period_s):
            write(journal, [0])
            now_s[0] += period_s
            return next(turns)

        def set(self):
            pass

    vars(journal)["_ending"] = Turns()
    journal._run()
    gaps_s = np.diff([100.0, *asked, now_s[0]])
    assert gaps_s[:-1].min() > 0.8
    assert gaps_s.max() <= 1.0
    journal.close()
    assert asked[-1] == now_s[0]


@given(st.binary(max_size=300), st.integers(0, 300))
def test_whatever_stands_behind_a_journal_s_rows_is_skipped(tmp_path_factory, rubbish, cut):
    path = tmp_path_factory.mktemp("journal") / "a.csv"
    with Journal(path, HEADER, threaded=False) as journal:
        write(journal, range(3))
    # A power cut may leave zeros, or what was on the disk before.
    path.write_bytes(path.read_bytes() + b"\0" * cut + rubbish)
    record = read_journal(path)
    assert record.ticks[:3].tolist() == [0, 1, 2]


def test_the_noise_that_arrived_is_sent_less_base(tmp_path):
    with Journal(tmp_path / "a.csv", HEADER, threaded=False) as journal:
        journal.append(0, 10.0, BASE, SENT, NOISE, 0.0)
        journal.append(1, 10.02, BASE, SENT, UNSENT, 0.0)
    noise = read_journal(journal.path).noise
    assert noise[0] == pytest.approx([0.05, -0.05, 1 / 3 - 0.3], abs=1e-8)
    assert not noise[1].any()


def test_what_is_no_journal_and_where_none_can_be_are_refused(tmp_path):
    (tmp_path / "other.csv").write_text("tick,time\n1,2\n")
    with pytest.raises(MtmError, match="does not begin like a journal"):
        read_journal(tmp_path / "other.csv")
    with pytest.raises(MtmError, match="check the name"):
        read_journal(tmp_path / "none.csv")
    with pytest.raises(MtmError, match="choose a folder"):
        Journal(tmp_path / "none" / "a.csv", HEADER, threaded=False)
