"""A camera that moves: its own motion is taken out of the tracks, and a camera that stands still is left alone."""

import cv2
import numpy as np
import pytest

from mtm_audit.decoding.assignment import assign_tracks
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Track
from mtm_audit.tracking.background import BackgroundFollower
from mtm_audit.tracking.background_path import background_path
from mtm_audit.tracking.camera_path import CameraPath, bridged
from mtm_audit.tracking.dictionaries import dictionary_of
from mtm_audit.tracking.reference import reference_path, still_tracks
from mtm_audit.tracking.registry import tracker
from mtm_audit.tracking.stabilise import stabilised_tracks
from mtm_onboard.protocol import MtmError
from tests.audit.moving_robot import scheme_of

WIDTH, HEIGHT, FRAMES = 400, 300, 45
MIDDLE = np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2])
CORNERS = ((60, 60), (340, 60), (60, 240), (340, 240))


def sheet(number, side_px=36):
    marker = cv2.aruco.generateImageMarker(dictionary_of("4x4_50"), number, side_px)
    return cv2.copyMakeBorder(marker, 6, 6, 6, 6, cv2.BORDER_CONSTANT, value=255)


def room(textured=True, markers=(), numbers=range(40, 50)):
    """What stands still, larger than the picture by 50 pixels on each side."""
    rng = np.random.default_rng(1)
    ground = np.full((HEIGHT + 100, WIDTH + 100), 120.0, np.float32)
    if textured:
        ground += cv2.GaussianBlur(rng.normal(0, 150, ground.shape).astype(np.float32), (0, 0), 2.0)
    ground = np.clip(ground, 0, 255).astype(np.uint8)
    for number, (column, row) in zip(numbers, markers, strict=False):
        ground[row + 26 : row + 74, column + 26 : column + 74] = sheet(number)
    return ground


def shaken(number, shake_px, roll_rad=0.0):
    """The camera's motion in a frame: from the room's pixels to the picture's, (3, 3)."""
    time_s = number / 30
    shift = shake_px * np.array([np.sin(2 * np.pi * 1.7 * time_s), np.sin(2 * np.pi * 2.3 * time_s + 1)])
    cos, sin = np.cos(roll_rad * np.sin(4 * time_s)), np.sin(roll_rad * np.sin(4 * time_s))
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    turn[:2, 2] = MIDDLE + shift - turn[:2, :2] @ (MIDDLE + 50)
    return turn


def robot_place(number):
    """Column and row in the room of a robot that drives and trembles."""
    time_s = number / 30
    return np.array([130 + 60 * time_s + 2 * np.sin(25 * time_s), 180 + 2 * np.sin(19 * time_s)])


def film(ground, shake_px=6.0, roll_rad=0.0, mirrored=False, size=FRAMES):
    for number in range(size):
        scene = ground.copy()
        shift = np.float32([[1, 0, 0], [0, 1, 0]])
        shift[:, 2] = robot_place(number) + 50 - 23.5
        robot = cv2.warpAffine(sheet(3), shift, scene.shape[::-1], borderValue=0)
        cover = cv2.warpAffine(np.full((48, 48), 255, np.uint8), shift, scene.shape[::-1]) / 255.0
        scene = (scene * (1 - cover) + robot * (cover > 0)).clip(0, 255).astype(np.uint8)
        motion = shaken(number, shake_px, roll_rad)[:2]
        image = cv2.warpAffine(scene, motion, (WIDTH, HEIGHT), flags=cv2.INTER_CUBIC)
        yield Frame(number / 30, np.ascontiguousarray(image[:, ::-1]) if mirrored else image)


def off_px(track):
    """The rms distance of the robot's track from the truth, a shift, turn and scale of the whole left free."""
    truth = np.array([robot_place(number) for number in range(len(track.times_s))])
    truth[:, 1] = HEIGHT - 1 - truth[:, 1]
    seen = track.positions - track.positions.mean(axis=0)
    aim = truth - truth.mean(axis=0)
    one, other = seen @ [1, 1j], aim @ [1, 1j]
    return float(np.sqrt(np.mean(np.abs(np.vdot(one, other) / np.vdot(one, one) * one - other) ** 2)))


def robot(frames, reference=(), warn=None):
    tracks = stabilised_tracks(tracker("aruco"), frames, reference, warn)
    return next(track for track in tracks if track.name == "marker3")


@pytest.mark.parametrize("markers", [(), CORNERS])
@pytest.mark.parametrize(("shake_px", "roll_rad"), [(3.0, 0.0), (12.0, 0.0), (4.0, 0.17)])
def test_shake_and_roll_are_taken_out(shake_px, roll_rad, markers):
    said = []
    track = robot(film(room(textured=not markers, markers=markers), shake_px, roll_rad), warn=said.append)
    assert track.valid.all()
    assert off_px(track) < 0.1
    assert len(said) == 1
    assert ("points of the background" in said[0]) != ("marker40, marker41, marker42, marker43" in said[0])


def test_without_a_reference_the_shake_stays():
    """What the others are measured by: an empty floor gives nothing to go by."""
    assert off_px(robot(film(room(textured=False), 6.0))) > 3


def test_one_named_marker_is_a_reference():
    """It leaves more than four do, since the camera's turn is told by its small sides alone."""
    track = robot(film(room(textured=False, markers=CORNERS[:1]), 6.0), reference=["marker40"])
    assert off_px(track) < 0.8


def test_a_reference_must_be_a_track():
    with pytest.raises(MtmError, match="there is no track 'marker9' to be the reference; the video shows: marker3"):
        robot(film(room(), size=8), reference=["marker9"])


@pytest.mark.parametrize("markers", [(), CORNERS])
def test_a_camera_that_stands_still_is_left_alone(markers):
    said = []
    ground = room(markers=markers)
    track = robot(film(ground, 0.0), warn=said.append)
    (plain,) = (one for one in tracker("aruco").track(film(ground, 0.0)) if one.name == "marker3")
    assert np.array_equal(track.positions, plain.positions)
    assert said == []


def test_a_mirrored_film_is_stabilised_too():
    assert off_px(robot(film(room(), 6.0, mirrored=True))) < 0.1


def test_a_floor_marker_with_a_robots_number_is_no_robot():
    """Body robot0 carries marker 3 and marker 0 lies on the floor, before a camera that shakes."""
    ground = room(markers=CORNERS[:1], numbers=(0,))
    tracks = stabilised_tracks(tracker("aruco"), film(ground, 8.0))
    assert [track.name for track in tracks] == ["marker0", "marker3"]
    assignment = assign_tracks(scheme_of(bodies=("robot0",)), tracks)
    assert assignment.settled == {}
    assert assignment.unsettled == ("robot0",)


def test_headings_are_in_the_frame_of_the_positions():
    track = robot(film(room(), 3.0, roll_rad=0.17))
    assert np.std(np.unwrap(track.headings_rad)) < 0.004
    rolled = next(one for one in tracker("aruco").track(film(room(), 3.0, 0.17)) if one.name == "marker3")
    assert np.std(np.unwrap(rolled.headings_rad)) > 0.05


def test_a_still_camera_is_looked_through_now_and_then():
    looked = BackgroundFollower()
    for frame in film(room(), 0.0, size=90):
        looked.look(frame)
    assert 30 < len(looked.looks) < 60


def test_a_film_that_begins_in_the_dark_is_stabilised_later():
    dark = [Frame(number / 30, np.zeros((HEIGHT, WIDTH), np.uint8)) for number in range(75)]
    shaking = [Frame(2.5 + one.time_s, one.image) for one in film(room(), 6.0, size=120)]
    looked = BackgroundFollower()
    for frame in [*dark, *shaking]:
        looked.look(frame)
    assert looked.keys[0].row > 75
    assert len(looked.looks) > 50


def test_a_picture_without_anything_has_no_background():
    frames = [Frame(number / 30, np.full((96, 128), 120, np.uint8)) for number in range(80)]
    looked = BackgroundFollower()
    for frame in frames:
        looked.look(frame)
    assert background_path(looked, [], flipped=False) is None


def tracks_of(places, names):
    times_s = np.arange(len(places)) / 30
    return [
        Track(name, times_s, places[:, column], np.ones(len(places), dtype=bool), unit="px")
        for column, name in enumerate(names)
    ]


def swinging(count=90):
    """Three still things and two robots before a shaking camera, (frames, 5, 2)."""
    times_s = np.arange(count)[:, None] / 30
    shake = 5 * np.concatenate([np.sin(11 * times_s), np.sin(13 * times_s + 1)], axis=1)
    still = np.array([[30.0, 30.0], [350.0, 40.0], [200.0, 260.0]])
    noise = 4 * np.stack([np.sin(np.arange(3, 5) * 5 * times_s), np.sin(np.arange(4, 6) * 4 * times_s)], axis=2)
    robots = np.array([[150.0, 150.0], [250.0, 150.0]]) + noise + 20 * times_s[..., None]
    return np.concatenate([np.broadcast_to(still, (count, 3, 2)), robots], axis=1) + shake[:, None]


def test_what_keeps_its_distances_is_found_to_stand_still():
    found = still_tracks(tracks_of(swinging(), "abcde"), (WIDTH, HEIGHT))
    assert [track.name for track in found] == ["a", "b", "c"]


def test_robots_that_move_alone_are_no_reference():
    assert still_tracks(tracks_of(swinging()[:, 3:], "de"), (WIDTH, HEIGHT)) == []
    assert still_tracks(tracks_of(swinging()[:, 2:], "cde"), (WIDTH, HEIGHT)) == []


def test_a_reference_that_is_hidden_leaves_frames_unknown():
    (track,) = tracks_of(swinging()[:, :1], "a")
    hidden = np.arange(90) < 20
    away = Track("a", track.times_s, np.where(hidden[:, None], np.nan, track.positions), ~hidden, unit="px")
    path = reference_path([away], (WIDTH, HEIGHT))
    assert path.known == pytest.approx(70 / 90)
    assert not path.applied(track).valid[:20].any()


def film_with_a_wall(first, last):
    """A camera that shakes, and that something without texture hides all from in the frames `first` to `last`."""
    for number, frame in enumerate(film(room(), 6.0, size=90)):
        image = frame.image
        if first <= number <= last:
            column, row = np.rint(shaken(number, 6.0) @ [*(robot_place(number) + 50), 1.0])[:2].astype(int)
            image = np.full_like(image, 120)
            around = np.s_[row - 26 : row + 26, column - 26 : column + 26]
            image[around] = frame.image[around]
        yield Frame(frame.time_s, image)


def test_stretches_without_a_background_are_told():
    said = []
    track = robot(film_with_a_wall(40, 50), warn=said.append)
    assert not track.valid[41:50].any()
    assert track.valid[:40].all()
    assert "not known in 12.2% of the frames (1.3 to 1.7 s): nothing is used of them" in said[-1]


def test_a_background_that_seldom_shows_is_told():
    said = []
    assert robot(film_with_a_wall(30, 75), warn=said.append).valid[35:70].all()
    assert len(said) == 1
    assert "the camera moved, and how is known in only" in said[0]


def test_a_path_names_its_unknown_stretches():
    homographies = np.tile(np.eye(3), (8, 1, 1))
    homographies[[0, 1, 4, 7]] = np.nan
    path = CameraPath(homographies, 0.1, "a test")
    assert path.unknown_s(np.arange(8.0)) == ((0.0, 1.0), (4.0, 4.0), (7.0, 7.0))
    assert CameraPath(np.tile(np.eye(3), (4, 1, 1)), 0.1, "a test").unknown_s(np.arange(4.0)) == ()


def test_short_gaps_are_bridged_and_long_ones_are_not():
    known = np.tile(np.eye(3), (10, 1, 1))
    known[[3, 6, 7, 8]] = np.nan
    filled = bridged(known, np.arange(10) * 0.1, 0.25)
    assert np.isfinite(filled[3]).all()
    assert np.isnan(filled[6:9]).all()


def test_a_path_carries_headings_along():
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    path = CameraPath(np.tile(quarter, (3, 1, 1)), 0.0, "a quarter turn")
    track = Track(
        "a", np.arange(3.0), np.ones((3, 2)), np.ones(3, dtype=bool), unit="px", headings_rad=np.array([0.0, 1.0, 2.0])
    )
    assert np.unwrap(path.applied(track).headings_rad) == pytest.approx(np.array([0.0, 1.0, 2.0]) + np.pi / 2)


def panning(size=60):
    """A pan over a room three pictures wide, in which a marker trembles; frames and where it is in the room."""
    rng = np.random.default_rng(2)
    ground = 120 + cv2.GaussianBlur(rng.normal(0, 150, (HEIGHT, 3 * WIDTH)).astype(np.float32), (0, 0), 2.0)
    ground = np.clip(ground, 0, 255).astype(np.uint8)
    frames, places = [], []
    for number in range(size):
        left = 10 * number
        column = 200 + left + round(15 * np.sin(number / 3))
        scene = ground[:, left : left + WIDTH].copy()
        scene[126:174, column - left - 24 : column - left + 24] = sheet(3)
        frames.append(Frame(number / 30, scene))
        places.append(column)
    return frames, np.array(places)


def test_a_long_pan_is_taken_out_over_several_key_pictures():
    frames, places = panning()
    looked = BackgroundFollower()
    for frame in frames:
        looked.look(frame)
    assert len(looked.keys) > 2
    track = robot(frames)
    assert track.valid.all()
    assert np.std(track.positions[:, 0] - places) < 0.3


def test_corners_go_where_their_frame_goes():
    shifts = np.tile(np.eye(3), (5, 1, 1))
    shifts[:, 0, 2] = np.arange(5)
    shifts[4] = np.nan
    places, offsets = np.full((5, 2), 20.0), np.array([[-3.0, 3.0], [3.0, 3.0], [3.0, -3.0], [-3.0, -3.0]])
    corners = places[:, None] + offsets
    track = Track("marker0", np.arange(5.0), places, np.ones(5, dtype=bool), unit="px", corners=corners)
    moved = CameraPath(shifts, 0.0, "a test").applied(track)
    assert moved.corners[:4] == pytest.approx(moved.positions[:4, None] + offsets)
    assert moved.corners[3, 0].tolist() == [20.0, 23.0]
    assert np.isnan(moved.corners[4]).all()
