from dataclasses import replace

import cv2
import numpy as np
import pytest

from hil.sensors.camera import Camera, film, top_pixels
from hil.sensors.optics import Optics, overhead
from hil.sensors.poses import Occlusion, Trajectory
from hil.sensors.scene import Scene
from hil.sensors.video import write_video
from mtm_audit.ingest.load import load_tracks, tracked
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Track
from mtm_audit.readers.video import read_frames
from mtm_audit.tracking.aruco import ArucoTracker
from mtm_audit.tracking.kalman import kalman_smoothed
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol import MtmError

SECONDS = 1.2
PHONE = Camera(
    optics=Optics(
        position_m=(2.2, -2.4, 2.4),
        target_m=(0.0, 0.0, 0.2),
        focal_px=700,
        width_px=960,
        height_px=540,
        roll_rad=0.15,
        radial=(-0.12, 0.02),
    ),
    rate_hz=30.0,
    jitter_s=0.004,
    drop_probability=0.1,
    exposure_s=0.008,
    blur_px=0.7,
    noise_levels=3.0,
)


def wandering(count=2):
    """Robots on circles of different phase, which pass every sub-pixel position and turn through every heading."""
    times_s = np.arange(round(SECONDS * 200) + 1) / 200
    robots = []
    for number in range(count):
        angles = 2 * np.pi * number / count + 0.9 * times_s
        positions = np.stack([0.8 * np.cos(angles), 0.7 * np.sin(angles)], axis=1)
        robots.append(Trajectory(f"robot{number}", times_s, positions, angles + np.pi / 2))
    return robots


def filmed(camera, path, scene=None, robots=None):
    write_video(film(camera, scene or Scene(), robots or wandering(), np.random.default_rng(1)), path)
    return path


def errors_px(track, robot, optics):
    """Tracked minus true position of the middle of the top, where valid, shape (n, 2), y up."""
    truth = top_pixels(optics, robot.at(track.times_s[track.valid])[0])
    truth[:, 1] = optics.height_px - 1 - truth[:, 1]
    return track.positions[track.valid] - truth


def rms(errors):
    return float(np.sqrt(np.mean(errors**2)))


def test_markers_from_above_are_tracked_to_a_tenth_of_a_pixel(tmp_path):
    robots = wandering(4)
    tracks = load_tracks(filmed(Camera(), tmp_path / "film.mp4", robots=robots))
    assert [track.name for track in tracks] == ["marker0", "marker1", "marker2", "marker3"]
    for track, robot in zip(tracks, robots, strict=True):
        assert track.unit == "px"
        assert track.valid.all()
        assert rms(errors_px(track, robot, overhead())) < 0.15


def test_headings_are_counter_clockwise_from_the_pictures_right(tmp_path):
    (track, _) = load_tracks(filmed(Camera(), tmp_path / "film.mp4"))
    truth = wandering()[0].at(track.times_s)[1]
    error = np.angle(np.exp(1j * (track.headings_rad - truth)))
    assert rms(error) < 0.03


def test_a_tilted_noisy_phone_of_irregular_frames_tracks(tmp_path):
    path, pictured = filmed(PHONE, tmp_path / "film.mp4"), []
    above = tracked(read_frames(path), "aruco", keep=pictured.append)
    tracks = pictured[0].tracks
    assert [track.name for track in tracks] == ["marker0", "marker1"]
    nominal = round(SECONDS * PHONE.rate_hz) + 1
    for track, robot in zip(tracks, wandering(), strict=True):
        assert len(track.times_s) < nominal
        assert np.std(np.diff(track.times_s)) > 0.003
        assert track.valid.mean() > 0.95
        assert rms(errors_px(track, robot, PHONE.optics)) < 0.3
    for track, robot in zip(above, wandering(), strict=True):
        # Seen from above, the path is that on the floor, but for its scale, and where and how it lies.
        true = robot.at(track.times_s[track.valid])[0] @ np.array([1.0, 1j])
        found = track.positions[track.valid] @ np.array([1.0, 1j])
        true, found = true - true.mean(), found - found.mean()
        assert np.linalg.norm(np.vdot(found, true) / np.vdot(found, found) * found - true) < 0.05 * np.linalg.norm(true)


def test_an_occluded_robot_is_missing_and_comes_back(tmp_path):
    camera = Camera(occlusions=(Occlusion("robot1", 0.4, 0.8),))
    seen, hidden = load_tracks(filmed(camera, tmp_path / "film.mp4"))
    span = (hidden.times_s >= 0.4) & (hidden.times_s < 0.8)
    assert seen.valid.all()
    assert not hidden.valid[span].any()
    assert np.isnan(hidden.positions[span]).all()
    assert hidden.valid[~span].all()


@pytest.mark.parametrize("name", ["aruco", "aruco:mirrored"])
def test_a_mirrored_video_is_read_by_flipping_it_back(tmp_path, name):
    optics = replace(overhead(), mirrored=True)
    (track, _) = load_tracks(filmed(Camera(optics=optics), tmp_path / "film.mp4"), name)
    assert rms(errors_px(track, wandering()[0], overhead())) < 0.15


def test_colours_are_tracked_and_told_apart(tmp_path):
    scene = Scene(colours_bgr=((220, 220, 30), (200, 40, 200), (30, 210, 220)))
    path = filmed(Camera(blur_px=0.6, noise_levels=2.0), tmp_path / "film.mp4", scene, wandering(3))
    tracks = {track.name: track for track in load_tracks(path, "colour:cyan,magenta,#dcd21e")}
    for name, robot in zip(("cyan", "magenta", "#dcd21e"), wandering(3), strict=True):
        assert tracks[name].valid.all()
        assert rms(errors_px(tracks[name], robot, overhead())) < 0.1
        assert tracks[name].headings_rad is None


def test_an_occluded_colour_is_missing(tmp_path):
    camera = Camera(occlusions=(Occlusion("robot1", 0.4, 0.8),))
    path = filmed(camera, tmp_path / "film.mp4", Scene(colours_bgr=((255, 255, 0), (0, 0, 255))))
    cyan, red = load_tracks(path, "colour:cyan,red")
    span = (red.times_s >= 0.4) & (red.times_s < 0.8)
    assert cyan.valid.all()
    assert not red.valid[span].any()
    assert red.valid[~span].all()


def test_progress_counts_the_frames(tmp_path):
    counts = []
    load_tracks(filmed(Camera(), tmp_path / "film.mp4"), progress=counts.append)
    assert counts == list(range(1, 38))


def gray_frames(count, shape=(96, 128)):
    return [Frame(row / 30, np.full(shape, 128, np.uint8)) for row in range(count)]


def test_a_video_of_nothing_is_refused():
    with pytest.raises(MtmError, match="no marker found in 5 frames"):
        tracker("aruco").track(gray_frames(5))
    with pytest.raises(MtmError, match="none of red found in 5 frames"):
        tracker("colour:red").track(gray_frames(5, (96, 128, 3)))


def test_no_frames_are_no_markers():
    with pytest.raises(MtmError, match="no marker found in 0 frames"):
        tracker("aruco").track([])


@pytest.mark.parametrize(("name", "depth"), [("aruco", ()), ("colour:red", (3,))])
def test_a_picture_that_changes_its_size_is_refused(name, depth):
    frames = [Frame(0.0, np.zeros((96, 128, *depth), np.uint8)), Frame(0.1, np.zeros((128, 96, *depth), np.uint8))]
    with pytest.raises(MtmError, match="from 128 x 96 to 96 x 128 at 0.100 s"):
        tracker(name).track(frames)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("magic", "no tracker 'magic'"),
        ("aruco:5x5", "no dictionary of markers '5x5'"),
        ("aruco:6x6_250,4x4_50", "more than one dictionary"),
        ("colour", "no tracker"),
        ("colour:", "no tracker"),
        ("colour:mauve-ish", "no colour"),
        ("colour:#12345", "no colour"),
        ("colour:#808080", "too gray"),
    ],
)
def test_an_unknown_tracker_is_refused_with_the_choices(name, says):
    with pytest.raises(MtmError, match=says):
        tracker(name)


def test_searching_nearby_finds_what_searching_everywhere_finds(tmp_path, monkeypatch):
    path = filmed(Camera(), tmp_path / "film.mp4")
    nearby = ArucoTracker().track(read_frames(path))
    monkeypatch.setattr("mtm_audit.tracking.follower.SEARCH_EVERY_S", 0.0)
    monkeypatch.setattr("mtm_audit.tracking.follower.FULL_SEARCH_EVERY", 1)
    everywhere = ArucoTracker().track(read_frames(path))
    for one, other in zip(nearby, everywhere, strict=True):
        assert np.array_equal(one.valid, other.valid)
        assert rms(one.positions - other.positions) < 0.05


def test_a_marker_is_not_followed_outside_the_picture():
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    marker = cv2.aruco.generateImageMarker(dictionary, 7, 36)
    frames = []
    for row in range(20):
        image = np.full((120, 200), 230, np.uint8)
        left = 100 + 8 * row
        visible = min(max(200 - left, 0), 36)
        image[40:76, left : left + visible] = marker[:, :visible]
        frames.append(Frame(row / 30, image))
    (track,) = ArucoTracker().track(frames)
    assert track.valid[:6].all()
    assert not track.valid[9:].any()
    assert track.positions[0] == pytest.approx([117.5, 119 - 57.5], abs=0.6)


def test_smoothing_lessens_noise_keeps_gaps_and_follows_motion():
    rng = np.random.default_rng(1)
    times_s = np.arange(400) / 50
    truth = np.stack([100 * np.sin(times_s), 40 * times_s], axis=1)
    positions = truth + 0.8 * rng.standard_normal(truth.shape)
    valid = np.ones(400, dtype=bool)
    valid[100:120] = False
    positions[~valid] = np.nan
    smooth = kalman_smoothed(Track("a", times_s, positions, valid, unit="px"), process_noise=0.03)
    settled = valid & (np.arange(400) > 20) & ((np.arange(400) < 100) | (np.arange(400) > 140))
    assert np.array_equal(smooth.valid, valid)
    assert np.isnan(smooth.positions[~valid]).all()
    assert rms((smooth.positions - truth)[settled]) < 0.7 * rms((positions - truth)[settled])


def test_the_papers_smoothing_passes_a_message_s_motion():
    times_s = np.arange(500) / 50
    positions = np.stack([3 * np.sin(2 * np.pi * 5 * times_s), np.zeros(500)], axis=1)
    smooth = kalman_smoothed(Track("a", times_s, positions, np.ones(500, dtype=bool), unit="px"))
    assert np.std(smooth.positions[50:, 0]) == pytest.approx(np.std(positions[50:, 0]), rel=0.1)
