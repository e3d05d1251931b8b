from dataclasses import replace

import numpy as np
import pytest

from hil.fleet.onboard_process import check_ticks
from hil.fleet.realtime import _aligned, _content, run_realtime
from hil.fleet.rig import RunSettings
from mtm_onboard.journal.journal import JournalHeader, JournalRecord, read_journal
from mtm_onboard.protocol import MtmError, save_key
from mtm_onboard.protocol.framing import Framing
from tests.hil.fleet.short_runs import fake_key, short_run
from tests.patience import PATIENCE_S


def journal(ticks, damaged=0):
    count = len(ticks)
    header = JournalHeader(
        fingerprint="0" * 16,
        key_id="fake",
        robot="robot0",
        channel="robot0",
        symbols=(0, 1, 2, 3),
        repeat=True,
        rate_hz=50.0,
        start_s=0.0,
        start_unix_s=None,
    )
    ticks = np.array(ticks, dtype=np.int64)
    rows, none = np.zeros((count, 3)), np.zeros(count)
    return JournalRecord(
        header=header,
        ticks=ticks,
        times_s=ticks / 50,
        base=rows,
        sent=rows,
        lateness_s=none,
        flags=none.astype(np.int64),
        damaged=damaged,
    )


def test_missed_ticks_are_counted():
    assert check_ticks("robot0", journal([-2, -1, 0, 1, 2])) == (5, 0)
    assert check_ticks("robot0", journal([-2, 0, 1, 5])) == (4, 4)


@pytest.mark.parametrize(
    ("record", "sentence"),
    [
        (journal([0, 1, 1, 2]), "a tick twice"),
        (journal([0, 2, 1]), "a tick twice"),
        (journal([]), "0 rows"),
        (journal([0, 1], damaged=1), "1 damaged"),
        (journal([3, 4]), "began at tick 3"),
    ],
)
def test_a_journal_that_shows_a_failed_run_is_refused(record, sentence):
    with pytest.raises(MtmError, match=sentence):
        check_ticks("robot0", record)


def framed_run(framing: Framing, payload, schedule="fixed") -> RunSettings:
    key = fake_key(300)
    key = replace(key, scheme=replace(key.scheme, framing=framing, schedule=schedule))
    return short_run(key=key, symbols=None, payload=payload)


@pytest.mark.parametrize(
    ("settings", "arguments"),
    [
        (short_run(), ["--symbols", "0,1,2,3"]),
        (short_run(symbols=None), ["--no-message"]),
        (framed_run(Framing("integer", 8), 77), ["--message=77"]),
        (framed_run(Framing("text", 8), "-"), ["--text=-"]),
        (framed_run(Framing("bytes", 8), b"\x0f"), ["--hex", "0f"]),
    ],
)
def test_the_programs_are_told_the_message_by_their_options(settings, arguments):
    assert _content(settings) == arguments


def test_a_rolling_run_in_real_time_waits_for_a_slot():
    settings = framed_run(Framing("integer", 8), 77, "rolling")
    aligned, start_unix_s = _aligned(settings, 1_800_000_001.5)
    assert start_unix_s == 1_800_000_006.0
    assert (aligned.start_s, aligned.seconds) == (settings.start_s + 4.5, settings.seconds + 4.5)
    fixed = short_run()
    assert _aligned(fixed, 1_800_000_001.5) == (fixed, 1_800_000_001.5)


@pytest.mark.realtime
@pytest.mark.parametrize("wire", ["can", "plaintext", "mavlink"])
def test_four_programs_drive_four_robots_in_real_time(tmp_path, wire):
    settings, result, folder = in_time(short_run(key=fake_key(100), wire=wire), tmp_path)
    assert [robot.name for robot in result.robots] == ["robot0", "robot1", "robot2", "robot3"]
    assert all(robot.is_stopped and robot.faults == 0 for robot in result.robots), result.robots
    for trajectory in result.trajectories:
        assert settings.start_s < trajectory.times_s[-1] <= settings.seconds
        # Else the message would not begin where the truth says.
        assert trajectory.times_s[0] == 0.0
        assert np.ptp(trajectory.positions_xy_m[:, 0]) > 0.3
    for robot in result.robots:
        header = read_journal(folder / f"{robot.name}.csv").header
        assert (header.symbols, header.fingerprint) == (settings.symbols, settings.key.scheme.fingerprint)


def in_time(settings, folder):
    """The run with as much time for four interpreters to start as they need on this machine, and its folder."""
    save_key(settings.key, folder / "robot.key")
    for start_s in (3.5, 12.0, 40.0):
        own = folder / f"{start_s}"
        own.mkdir()
        given = replace(settings, start_s=start_s, seconds=start_s + 2.5)
        try:
            return given, run_realtime(given, folder / "robot.key", own), own
        except MtmError as refusal:
            if "less busy machine" not in str(refusal):
                raise
    raise AssertionError("four programs did not start in 40 s")


@pytest.mark.realtime
def test_a_program_that_fails_ends_the_run_with_its_own_words(tmp_path):
    settings = short_run(seconds=PATIENCE_S, start_s=3.5)
    (tmp_path / "robot.key").write_text("no key")
    (tmp_path / "robot.key").chmod(0o600)
    with pytest.raises(MtmError, match="mtm-onboard of robot[0-3] ended with code 1.*robot.key is no key file"):
        run_realtime(replace(settings, symbols=None), tmp_path / "robot.key", tmp_path)


@pytest.mark.realtime
def test_a_program_that_ends_early_ends_the_run(tmp_path, monkeypatch):
    early = tmp_path / "mtm-onboard"
    early.write_text("#!/bin/sh\necho gone\n")
    early.chmod(0o755)
    monkeypatch.setattr("hil.fleet.onboard_process.program", lambda _: str(early))
    with pytest.raises(MtmError, match=r"mtm-onboard of robot0 ended with code 0 \(gone\)"):
        run_realtime(short_run(seconds=PATIENCE_S, start_s=3.5), tmp_path / "robot.key", tmp_path)
