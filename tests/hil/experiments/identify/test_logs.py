from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.experiments.identify.logs import CommandLog, logged_run, read_commands, read_truth
from mtm_audit.model.track import Track
from mtm_onboard.journal.journal import Journal, JournalHeader
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import MtmError
from tests.hil.experiments.identify.logged_robot import write_mrclam


def test_the_files_of_the_data_set_are_read(tmp_path):
    odometry, truth = write_mrclam(tmp_path, seconds=20.0)
    commands, track = read_commands(odometry), read_truth(truth)
    assert commands.velocities.shape == (2000, 3)
    assert commands.times_s[0] == 100.0
    assert np.all(commands.velocities[:, 1] == 0.0)
    assert track.positions.shape == (2000, 2)
    assert np.abs(track.headings_rad).max() <= np.pi


def test_of_commands_of_one_instant_the_last_counts(tmp_path):
    (tmp_path / "a.dat").write_text("1.0 0.1 0.0\n3.0 0.3 0.0\n1.0 0.2 0.5\n")
    commands = read_commands(tmp_path / "a.dat", later_s=10.0)
    assert commands.times_s.tolist() == [11.0, 13.0]
    assert commands.velocities.tolist() == [[0.2, 0.0, 0.5], [0.3, 0.0, 0.0]]


def test_a_table_of_commands_may_leave_axes_out(tmp_path):
    (tmp_path / "a.csv").write_text("# a comment\nwz, Time ,note\n0.5,1.0,7\n0.25,2.0,8\n")
    commands = read_commands(tmp_path / "a.csv")
    assert commands.times_s.tolist() == [1.0, 2.0]
    assert commands.velocities.tolist() == [[0.0, 0.0, 0.5], [0.0, 0.0, 0.25]]


def test_a_journal_counts_from_its_first_tick(tmp_path):
    header = JournalHeader(
        robot="robot0", channel="robot0", key_id="fake", fingerprint="f" * 16, symbols=(0,), repeat=True, rate_hz=50.0,
        start_s=1234.0, start_unix_s=None,
    )  # fmt: skip
    with Journal(tmp_path / "a.csv", header, threaded=False) as journal:
        for tick in range(3):
            journal.append(tick, 1234.0 + 0.02 * tick, BodyVelocity(0, 0, 0), BodyVelocity(0.1 * tick, 0.2, 0), 1, 0.0)
    commands = read_commands(tmp_path / "a.csv", later_s=1.5)
    assert commands.times_s == pytest.approx([1.5, 1.52, 1.54])
    assert commands.velocities[2] == pytest.approx([0.2, 0.2, 0.0])


def test_commands_are_averaged_as_they_were_held():
    commands = CommandLog(np.array([0.0, 0.25, 10.0]), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.4], [0.0, 0.0, 0.0]]))
    times_s = np.arange(0.0, 8.0, 0.01)
    run = logged_run(commands, still(times_s), 2.0)
    assert run.commanded[:2] == pytest.approx(np.array([[0.5, 0.0, 0.2], [0.0, 0.0, 0.4]]))


def still(times_s):
    count = len(times_s)
    return Track("a", times_s, np.zeros((count, 2)), np.ones(count, bool), headings_rad=np.zeros(count))


def test_motion_is_turned_by_the_heading_and_gaps_are_marked():
    times_s = np.delete(np.arange(0.0, 8.0, 0.01), slice(300, 400))
    headings = 0.5 * times_s
    positions = np.stack([np.sin(headings), -np.cos(headings)], axis=1)
    track = Track("a", times_s, positions, np.ones(len(times_s), bool), headings_rad=headings)
    run = logged_run(CommandLog(np.array([0.0, 9.0]), np.zeros((2, 3))), track, 10.0)
    assert run.moved[run.seen] == pytest.approx(np.tile([0.5, 0.0, 0.5], (int(run.seen.sum()), 1)), abs=1e-4)
    assert np.flatnonzero(~run.seen)[[0, -1]].tolist() in ([29, 39], [29, 40], [30, 39])


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("a.dat", "1 2 3\n4 5\n", "line 2: expected 3 numbers"),
        ("a.dat", "1 2 3\n4 5 nan\n", "line 2: expected 3 numbers"),
        ("a.dat", "# nothing\n1 2 3\n", "holds 1 lines of numbers"),
        ("a.csv", "time,speed\n1,2\n", "the header must name 'time' and some of"),
        ("a.csv", "time,vx\n1,2\n3,x\n", "expected 2 numbers"),
    ],
)
def test_broken_commands_get_one_sentence(tmp_path, name, text, sentence):
    (tmp_path / name).write_text(text)
    with pytest.raises(MtmError, match=sentence):
        read_commands(tmp_path / name)


@given(text=st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=200))
def test_no_text_breaks_the_readers(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("logs") / "a.dat"
    path.write_text(text, encoding="utf-8")
    for read in (read_commands, read_truth):
        with suppress(MtmError):
            assert len(read(path).times_s) >= 2


def test_motion_without_headings_gets_one_sentence(tmp_path):
    (tmp_path / "a.csv").write_text("time,x,y\n" + "".join(f"{row},0,0\n" for row in range(5)))
    with pytest.raises(MtmError, match="has no headings, which tell ahead from sideways"):
        read_truth(tmp_path / "a.csv")


def test_the_axis_that_points_ahead_may_be_told(tmp_path):
    level = "".join(f"{row / 10} 0 0 0 0 0 0 1\n" for row in range(20))
    (tmp_path / "a.tum").write_text(level)
    ahead, left = (read_truth(tmp_path / "a.tum", axis) for axis in ("x", "y"))
    assert ahead.headings_rad == pytest.approx(np.zeros(20))
    assert left.headings_rad == pytest.approx(np.full(20, np.pi / 2))


def test_an_axis_of_what_states_its_heading_gets_one_sentence(tmp_path):
    _, truth = write_mrclam(tmp_path, seconds=5.0)
    with pytest.raises(MtmError, match="states the heading itself; leave --heading-axis out"):
        read_truth(truth, "x")


@pytest.mark.parametrize("axis", ["w", "xy", ""])
def test_an_axis_that_is_none_gets_one_sentence(tmp_path, axis):
    (tmp_path / "a.tum").write_text("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n")
    with pytest.raises(MtmError, match="axis"):
        read_truth(tmp_path / "a.tum", axis)


def test_logs_of_different_times_get_one_sentence():
    commands = CommandLog(np.array([0.0, 9.0]), np.zeros((2, 3)))
    with pytest.raises(MtmError, match="at no time together; give --offset"):
        logged_run(commands, still(100.0 + np.arange(50) * 0.1), 20.0)
