import pytest
from rich.console import Console

from mtm_audit.live.events import Pose
from mtm_audit.live.record import PoseRecord
from mtm_audit.live.state import WatchState
from mtm_audit.live.terminal import board
from mtm_audit.readers.logs.registry import read_log
from tests.audit.live.watched import KEY, poses, watch_of


@pytest.fixture(scope="module")
def state():
    state = WatchState("udp://127.0.0.1:5005", KEY, 1e-4)
    _, told = watch_of(poses())
    for judged in told.looks:
        state.judged(judged)
    return state


def test_evidence_rises_in_the_terminal(state):
    state.noticed("[bold]the camera[/bold] has dropped")
    console = Console(width=120, force_terminal=False)
    with console.capture() as captured:
        console.print(board(state.snapshot(), "http://127.0.0.1:8000/"))
    text = captured.get()
    assert "robot0" in text
    assert "decoded" in text
    assert "█" in text
    assert "[bold]the camera[/bold] has dropped" in text


def test_points_hold_the_evidence_by_channel(state):
    snapshot = state.snapshot()
    assert snapshot.points[-1].bits > snapshot.needed_bits
    assert set(snapshot.points[-1].channels) == {"robot0"}
    assert snapshot.bodies == {"robot0": "robot0"}
    assert snapshot.weighed <= snapshot.looks


def test_recorded_poses_are_read_as_motion_capture(tmp_path):
    sent = [Pose("a/../b", 0.1 * k, float(k), 2.0, 0.25) for k in range(20)]
    sent.append(Pose("a/../b", 2.0, float("nan"), float("nan")))
    with PoseRecord(tmp_path) as record:
        for pose in (*sent, Pose("a.._b", 0.0, 1.0, 1.0)):
            record.put(pose)
    assert len(list(tmp_path.iterdir())) == 2
    (body,) = read_log(next(path for path in tmp_path.iterdir() if path.stat().st_size > 100)).tracks
    assert body.positions[:20, 0].tolist() == [pose.x for pose in sent[:20]]
    assert not body.valid[20]
    assert body.headings_rad[3] == 0.25
