"""Robots that turn: noise along their own axes, and in their turning itself, through the public path."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.ingest.recording import read_recording
from mtm_audit.model.recording import Recording
from mtm_audit.model.track import Track
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.readers.logs.registry import read_log
from mtm_audit.reporting.json_report import json_report
from mtm_audit.reporting.text import frame_sentence
from mtm_onboard.protocol import Channel
from tests.audit.moving_robot import key_of, scheme_of

ONSET_S, RATE_HZ, STEP_S = 0.6, 50.0, 0.02
SENT = (2, 5, 3, 0)


def key(axes):
    channel = Channel("robot0", "robot0", axes, len(SENT), 0.1)
    return key_of(replace(scheme_of(symbols=(4,), ticks=800, alphabet=8), channels=(channel,)))


def played(axes, seconds):
    """What the robot plays on each of the axes, (instants, axes), lagged by a tenth of a second."""
    book, channel = key(axes).codebook(), key(axes).scheme.channels[0]
    message = np.concatenate([book.samples(channel, 0, [symbol])[0] for symbol in SENT], axis=1).T
    first, count = round(ONSET_S * RATE_HZ), round(seconds * RATE_HZ)
    demand = np.zeros((count, len(axes)))
    demand[first : first + len(message)] = channel.sigma * message[: count - first]
    followed, keep = np.zeros_like(demand), np.exp(-STEP_S / 0.1)
    for row in range(1, count):
        followed[row] = keep * followed[row - 1] + (1.0 - keep) * demand[row - 1]
    return followed


@cache
def driven(axes, *, spin_radps=0.0, seed=0, headings=True, yaw_gain=3.0):
    """A robot that drives on, spins, and plays on `axes` of its own; slip and motion capture add their noise."""
    rng, followed = np.random.default_rng(seed), played(axes, 17.0)
    count = len(followed)
    own = {axis: followed[:, row] for row, axis in enumerate(axes)}
    forward = 0.3 + own.get("vx", 0.0) + 0.03 * rng.standard_normal(count)
    lateral = own.get("vy", 0.0) + (0.03 if "vy" in axes else 0.003) * rng.standard_normal(count)
    yaw = spin_radps + yaw_gain * own.get("wz", 0.0) + 0.1 * rng.standard_normal(count)
    headings_rad = np.cumsum(yaw) * STEP_S
    velocities = (forward + 1j * lateral) * np.exp(1j * headings_rad)
    places = np.cumsum(velocities) * STEP_S
    positions = np.stack([places.real, places.imag], axis=1) + 5e-4 * rng.standard_normal((count, 2))
    seen = np.ones(count, dtype=bool)
    return Track("robot0", np.arange(count) * STEP_S, positions, seen, headings_rad=headings_rad if headings else None)


def decoded(track, axes, **settings):
    return decode_tracks([track], key(axes), DecodeSettings(**settings))


def told(found, *tracks):
    return frame_sentence(Recording((), "motion capture", tracks), found)


@pytest.mark.parametrize("onset_s", [None, ONSET_S], ids=["searched", "known"])
def test_a_robot_that_spins_is_read_along_its_own_axes(onset_s):
    axes = ("vx", "vy")
    found = decoded(driven(axes, spin_radps=1.2), axes, onset_s=onset_s)
    # Which symbol comes first nothing shows where the onset is searched.
    turns = [SENT] if onset_s is not None else [SENT[-place:] + SENT[:-place] for place in range(4)]
    assert (found.frame, found.symbols in turns) == ("body", True)
    assert "headings as recorded;" in told(found, driven(axes, spin_radps=1.2))
    blind = decoded(driven(axes, spin_radps=1.2, headings=False), axes, onset_s=onset_s)
    assert found.evidence.nats > blind.evidence.nats + 15.0


def test_a_robot_that_holds_its_heading_is_read_as_before():
    axes = ("vx", "vy")
    found = decoded(driven(axes), axes, onset_s=ONSET_S)
    without = decoded(driven(axes, headings=False), axes, onset_s=ONSET_S)
    assert (found.verdict, found.frame) == ("decoded", "world")
    assert told(found, driven(axes)) is None
    assert found.evidence == without.evidence


def test_a_rover_is_read_from_its_speed_and_its_turning():
    axes = ("vx", "wz")
    found = decoded(driven(axes), axes, onset_s=ONSET_S)
    assert (found.verdict, found.symbols, found.frame) == ("decoded", SENT, "body")
    speed_alone = decoded(driven(axes, yaw_gain=0.0), axes, onset_s=ONSET_S)
    assert found.evidence.nats > speed_alone.evidence.nats + 5.0


def test_a_rover_without_headings_shows_them_by_its_path():
    axes = ("vx", "wz")
    found = decoded(driven(axes, headings=False), axes, onset_s=ONSET_S)
    assert (found.symbols, found.frame) == (SENT, "path")
    assert "as their paths show them" in told(found, driven(axes, headings=False))


def test_the_paper_s_detector_reads_turning_as_well():
    axes = ("vx", "wz")
    found = decoded(driven(axes), axes, onset_s=ONSET_S, detector="coherency")
    assert found.symbols == SENT
    assert found.frame == "body"


@pytest.mark.parametrize("axes", [("vx", "vy"), ("vx", "wz")], ids=["plane", "rover"])
def test_another_key_s_robot_that_turns_says_nothing(axes):
    other = key_of(key(axes).scheme, b"another fake test secret" + bytes(8))
    found = decode_tracks([driven(axes, spin_radps=0.8)], other, DecodeSettings(onset_s=ONSET_S))
    assert (found.verdict, found.message) == ("absent", None)


# Rows are the floor's two axes and up in the room's terms; columns a body's axes in terms of forward, left and up.
ROOMS = {"z": np.eye(3), "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])}
BODIES = {
    "z": np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
    "-y": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}


def captured(folder, track, up, ahead):
    """The track as a rigid body in a room whose axis `up` points up; the body's axis `ahead` leads."""
    floor = np.column_stack([track.positions, np.full(len(track.times_s), 0.2)])
    turns = Rotation.from_euler("z", track.headings_rad[:, None])
    poses = Rotation.from_matrix(ROOMS[up].T) * turns * Rotation.from_matrix(BODIES[ahead])
    path = folder / "robot0.tum"
    np.savetxt(path, np.column_stack([track.times_s, floor @ ROOMS[up], poses.as_quat()]), fmt="%.9f")
    return path


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("ahead", ["z", "-y"])
def test_the_axis_that_leads_gives_the_heading(tmp_path, up, ahead):
    track = driven(("vx", "vy"), spin_radps=1.2)
    path = captured(tmp_path, track, up, ahead)
    (read,) = read_log(path, ReadOptions(up=up, heading_axis=ahead)).tracks
    assert np.abs(np.angle(np.exp(1j * (read.headings_rad - track.headings_rad)))).max() < 1e-6
    assert (read.heading_axis, np.allclose(read.positions, track.positions)) == (ahead, True)


@pytest.mark.parametrize(("up", "ahead"), [("y", "z"), ("z", "-y")], ids=["optitrack", "minus y leads"])
def test_a_rigid_body_is_read_along_the_axis_that_leads(tmp_path, up, ahead):
    path = captured(tmp_path, driven(("vx", "vy"), spin_radps=1.2), up, ahead)
    recording = read_recording([path], "motion capture", options=ReadOptions(up=up, heading_axis=ahead))
    found = decoded(recording.tracks[0], ("vx", "vy"), onset_s=ONSET_S)
    assert (found.verdict, found.symbols, found.frame) == ("decoded", SENT, "body")
    assert f"headings as recorded (the {ahead} axis of robot0);" in frame_sentence(recording, found)
    assert json.loads(json_report(recording, found, ()))["channels"][0]["heading_axis"] == ahead
    # Whichever axis lies level, headings are off by a constant at most, which decoding allows for.
    (read,) = read_log(path, ReadOptions(up=up)).tracks
    unasked = decoded(read, ("vx", "vy"), onset_s=ONSET_S)
    assert read.heading_axis == "x"
    assert unasked.evidence.nats == pytest.approx(found.evidence.nats, abs=1.0)
