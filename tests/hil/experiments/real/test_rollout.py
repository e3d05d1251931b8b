import hashlib
from dataclasses import replace

import numpy as np
import pytest

from hil.experiments.real.rollout import RealJob, job_of, job_parameters, piece_of, read_real
from hil.plants.robots import path
from hil.worlds.open_loop import spinning
from mtm_audit.model.track import Track

JOB = RealJob(
    frame="world", sigma=0.1, alphabet_size=8, window_s=2.0, seconds=16.0, band_hz=(0.5, 4.0), threshold=1e-4,
    onset_known=False,
)  # fmt: skip


def spinning_track(seconds=20.0, noise_m=0.0005, seed=3):
    draw = np.random.default_rng(seed)
    count = round(seconds * 100)
    course = spinning(count, 0.01, draw)
    positions = path(course, 0.01)[:, :2] + noise_m * draw.standard_normal((count, 2))
    return Track("robot", np.arange(count) * 0.01, positions, np.ones(count, bool),
                 headings_rad=np.cumsum(course[:, 2]) * 0.01)  # fmt: skip


def written(folder, track):
    path = folder / "robot.csv"
    rows = np.column_stack([track.times_s, track.positions, track.headings_rad])
    np.savetxt(path, rows, delimiter=",", header="time,x,y,yaw", comments="", fmt="%.6f")
    return {"path": str(path), "digest": hashlib.sha256(path.read_bytes()).hexdigest()[:16]}


def test_a_loud_message_is_decoded_and_every_window_right(tmp_path):
    result = read_real({**written(tmp_path, spinning_track()), **job_parameters(JOB)}, 1)
    assert (result["verdict"], result["likeliest_right"]) == ("decoded", True)
    assert result["bits"] > 13.3
    assert result["windows"] in (6, 7)
    assert result["genie"] == result["windows"]
    assert result["genie_sure"] is True
    assert result["matched"] >= result["windows"] - 1


def test_a_silent_recording_is_absent(tmp_path):
    job = replace(JOB, sigma=1e-4)
    result = read_real({**written(tmp_path, spinning_track()), **job_parameters(job)}, 2)
    assert result["verdict"] == "absent"
    assert result["genie"] < result["windows"]
    assert result["genie_sure"] is False


def test_a_job_survives_as_the_parameters_of_a_cell():
    assert job_of(job_parameters(JOB)) == JOB


def test_a_piece_is_as_long_as_asked_and_lies_where_drawn():
    track = spinning_track()
    assert piece_of(track, 5.0, 0.0).times_s[[0, -1]] == pytest.approx([0.0, 5.0])
    assert piece_of(track, 5.0, 1.0).times_s[-1] == track.times_s[-1]
    assert len(piece_of(track, 50.0, 0.7).times_s) == len(track.times_s)


def test_a_piece_that_shows_too_little_is_refused(tmp_path):
    track = spinning_track()
    kept = (track.times_s < 0.5) | (track.times_s > 19.7)
    short = Track("robot", track.times_s[kept], track.positions[kept], np.ones(int(kept.sum()), bool),
                  headings_rad=track.headings_rad[kept])  # fmt: skip
    result = read_real({**written(tmp_path, short), **job_parameters(JOB)}, 1)
    assert (result["verdict"], result["windows"], result["genie"]) == ("refused", 0, 0)


def test_a_piece_without_any_sample_is_the_next_one():
    track = spinning_track()
    kept = (track.times_s < 0.5) | (track.times_s > 19.7)
    gappy = Track("robot", track.times_s[kept], track.positions[kept], np.ones(int(kept.sum()), bool),
                  headings_rad=track.headings_rad[kept])  # fmt: skip
    assert piece_of(gappy, 1.0, 0.5).times_s == pytest.approx([19.71])
