"""Following frame by frame: as a film that ends there, and what is forgotten is gone."""

import cv2
import numpy as np
import pytest

from mtm_audit.model.picture import Frame
from mtm_audit.tracking.background import BackgroundFollower
from mtm_audit.tracking.following import following
from mtm_audit.tracking.registry import tracker
from mtm_audit.tracking.stabilise import stabilised_tracks, without_camera
from mtm_onboard.protocol import MtmError
from tests.audit.tracking.test_stabilise import film, off_px, robot_place, room


def coloured(size=20):
    for number in range(size):
        image = np.full((120, 160, 3), 100, np.uint8)
        if number not in (5, 6):
            cv2.circle(image, (40 + 2 * number, 60 + number), 9, (0, 0, 255), -1)
        yield Frame(number / 30, image)


def filmed(name):
    return list(film(room(), 0.0, size=20)) if name == "aruco" else list(coloured())


def is_same(one, other):
    return (
        one.name == other.name
        and np.array_equal(one.times_s, other.times_s)
        and np.array_equal(one.positions, other.positions, equal_nan=True)
        and np.array_equal(one.valid, other.valid)
    )


@pytest.mark.parametrize("name", ["aruco", "colour:red", "centroid:red"])
def test_what_was_seen_so_far_is_the_film_s_track_up_to_there(name):
    frames, followed = filmed(name), following(name)
    for count, frame in enumerate(frames, 1):
        followed.look(frame)
        if count in (10, 20):
            tracks = followed.tracks()
            whole = tracker(name).track(iter(frames[:count]))
            assert all(is_same(*pair) for pair in zip(tracks, whole, strict=True))


@pytest.mark.parametrize("name", ["aruco", "colour:red", "centroid:red"])
def test_what_was_forgotten_is_gone_and_the_rest_stays(name):
    frames, followed = filmed(name), following(name)
    for frame in frames[:15]:
        followed.look(frame)
    (before,) = followed.tracks()
    followed.forget(7.5 / 30)
    for frame in frames[15:]:
        followed.look(frame)
    (after,) = followed.tracks()
    assert after.times_s.tolist() == [frame.time_s for frame in frames[8:]]
    assert np.array_equal(after.positions[:7], before.positions[8:15], equal_nan=True)


@pytest.mark.parametrize("mirrored", [False, True])
def test_places_in_the_last_frame_are_those_of_the_picture(mirrored):
    followed = following("aruco:mirrored" if mirrored else "aruco")
    for frame in film(room(), 0.0, size=8, mirrored=mirrored):
        followed.look(frame)
    column, row = followed.latest()["marker3"]
    wanted = robot_place(7)
    assert column == pytest.approx(399 - wanted[0] if mirrored else wanted[0], abs=1.0)
    assert row == pytest.approx(wanted[1], abs=1.0)


def test_a_picture_of_another_size_is_refused():
    followed = following("aruco")
    followed.look(Frame(0.0, np.zeros((30, 40), np.uint8)))
    with pytest.raises(MtmError, match="changes from 40 x 30 to 40 x 32"):
        followed.look(Frame(0.1, np.zeros((32, 40), np.uint8)))


def test_a_tracker_that_needs_the_end_is_refused():
    with pytest.raises(
        MtmError, match="the tracker arms takes whole films alone; watch with aruco, colour or centroid"
    ):
        following("arms:red,blue")


@pytest.fixture(scope="module")
def shaken():
    """What followed a camera that shakes, whole."""
    return shaken_and_followed(None)


def shaken_and_followed(forgotten_s):
    followed, seen = following("aruco"), BackgroundFollower()
    for frame in film(room(), 6.0, size=45):
        followed.look(frame)
        seen.look(frame)
        if forgotten_s is not None and frame.time_s == forgotten_s + 0.5:
            followed.forget(forgotten_s)
            seen.forget(forgotten_s)
    return followed, seen


def test_the_camera_s_motion_is_taken_out_of_a_part_as_of_a_film(shaken):
    followed, seen = shaken
    tracks = without_camera(followed.tracks(), seen.until(np.inf))
    whole = stabilised_tracks(tracker("aruco"), film(room(), 6.0, size=45))
    assert all(is_same(*pair) for pair in zip(tracks, whole, strict=True))


def test_it_is_taken_out_after_the_beginning_was_forgotten(shaken):
    followed, seen = shaken_and_followed(0.5)
    (track,) = without_camera(followed.tracks(), seen.until(np.inf))
    assert len(track.times_s) == 30
    truth = np.array([robot_place(number) for number in range(15, 45)])
    truth[:, 1] = 299 - truth[:, 1]
    assert np.std(track.positions - truth - (track.positions - truth).mean(axis=0)) < 0.2
    assert off_px(shaken[0].tracks()[0]) > 3


def test_until_an_instant_the_background_goes_with_the_tracks(shaken):
    _, seen = shaken
    part = seen.until(0.5)
    assert len(part.times_s) == 15
    assert max(look.row for look in part.looks) == 14
    assert all(key.image.size == 0 for key in part.keys)
