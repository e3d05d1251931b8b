"""Markers that show from which side they are seen: their tracks as from straight above."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.sensors.optics import Optics
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.ingest.load import tracked
from mtm_audit.model.lens import Lens
from mtm_audit.model.track import Track
from mtm_audit.tracking.ground_plane import from_above, ground_plane
from mtm_audit.tracking.lens import straightened_track
from tests.audit.moving_robot import key_of, robot_track, scheme_of
from tests.audit.small_films import SIZE, frames, marker

SIZE_PX = (1280, 960)
FRAMES, NOISE_PX = 80, 0.05
# Corners of a marker that looks along x, from its upper left one on, clockwise from above.
CORNERS = np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])


def camera(tilt_deg, radial=(0.0, 0.0), turn_deg=20.0):
    """A camera that looks so far from straight down at the middle of the floor."""
    tilt, turn = np.deg2rad(tilt_deg), np.deg2rad(turn_deg)
    place = 4.5 * np.array([np.sin(tilt) * np.sin(turn), -np.sin(tilt) * np.cos(turn), np.cos(tilt)])
    return Optics(
        position_m=tuple(place), target_m=(0.0, 0.0, 0.0), focal_px=860.0, width_px=1280, height_px=960, radial=radial
    )


def lens_of(optics):
    return Lens(
        name="wide.yaml",
        size_px=(optics.width_px, optics.height_px),
        focal_px=(optics.focal_px,) * 2,
        centre_px=((optics.width_px - 1) / 2, (optics.height_px - 1) / 2),
        distortion=(*optics.radial, 0.0, 0.0),
    )


def places(number, count=FRAMES):
    """Where a robot drives, and where it looks."""
    phase = np.linspace(0.0, 3.0, count) + 2.0 * number
    return np.column_stack([1.4 * np.cos(phase), 1.1 * np.sin(1.3 * phase)]), 1.7 * phase


def seen_by(optics, number, xy_m, headings_rad, *, side_m=0.14, height_m=0.2, noise_px=NOISE_PX, flipped=False):
    """The track of a marker on a robot, in pixels with y up."""
    rng = np.random.default_rng(number)
    ahead = np.stack([np.cos(headings_rad), np.sin(headings_rad)], axis=1)
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    outline = xy_m[:, None] + 0.5 * side_m * (CORNERS[:, :1] * ahead[:, None] + CORNERS[:, 1:] * left[:, None])

    def shown(points):
        flat = points.reshape(-1, 2)
        pixels = optics.project(np.column_stack([flat, np.full(len(flat), height_m)]))
        pixels += noise_px * rng.standard_normal(pixels.shape)
        across = SIZE_PX[0] - 1 - pixels[:, 0] if flipped else pixels[:, 0]
        return np.column_stack([across, SIZE_PX[1] - 1 - pixels[:, 1]]).reshape(points.shape)

    positions, beside = shown(xy_m), shown(xy_m + 0.05 * ahead)
    looks = beside - positions
    valid = np.ones(len(xy_m), dtype=bool)
    return Track(
        name=f"marker{number}", times_s=np.arange(len(xy_m)) / 25.0, positions=positions, valid=valid, unit="px",
        headings_rad=np.arctan2(looks[:, 1], looks[:, 0]), corners=shown(outline),
    )  # fmt: skip


def robots(optics, count=3, **how):
    return [seen_by(optics, number, *places(number), **how) for number in range(count)]


def unlike(found, true_xy_m, *, flipped=False):
    """How far places are from the true ones, after the best turn, scale and shift, as a part of their spread."""
    one, other = (points @ np.array([1.0, 1j]) for points in (found, true_xy_m))
    other = np.conj(other) if flipped else other
    one, other = one - one.mean(), other - other.mean()
    turn = np.vdot(one, other) / np.vdot(one, one)
    return float(np.linalg.norm(turn * one - other) / np.linalg.norm(other))


@pytest.mark.parametrize("flipped", [False, True], ids=["plain", "mirrored"])
@pytest.mark.parametrize("tilt_deg", [30.0, 50.0, 70.0])
def test_paths_get_the_shape_that_they_have_on_the_floor(tilt_deg, flipped):
    optics = camera(tilt_deg)
    tracks = robots(optics, flipped=flipped)
    above = from_above(tracks, SIZE_PX, flipped=flipped)
    for number, (before, after) in enumerate(zip(tracks, above, strict=True)):
        true_xy_m, _ = places(number)
        assert unlike(after.positions, true_xy_m, flipped=flipped) < 0.01 < unlike(before.positions, true_xy_m)
        assert after.corners is None
    plane = ground_plane(tracks, SIZE_PX, flipped=flipped)
    assert np.rad2deg(plane.tilt_rad) == pytest.approx(tilt_deg, abs=1.0)


@settings(max_examples=15)
@given(st.floats(25.0, 75.0), st.floats(-180.0, 180.0))
def test_with_the_lens_known_any_view_is_seen_through(tilt_deg, turn_deg):
    optics = camera(tilt_deg, turn_deg=turn_deg)
    plane = ground_plane(robots(optics), SIZE_PX, lens_of(optics))
    assert np.rad2deg(plane.tilt_rad) == pytest.approx(tilt_deg, abs=0.5)


def test_a_robot_looks_where_it_looked():
    optics = camera(65.0)
    tracks = robots(optics)
    above = from_above(tracks, SIZE_PX, lens_of(optics))
    for number, track in enumerate(above):
        turns = np.exp(1j * (track.headings_rad - places(number)[1]))
        assert np.abs(np.angle(turns / turns.mean())).max() < np.deg2rad(5.0)
        crooked = np.exp(1j * (tracks[number].headings_rad - places(number)[1]))
        assert np.abs(np.angle(crooked / crooked.mean())).max() > np.deg2rad(15.0)


def test_markers_of_other_sizes_and_heights_share_the_view():
    optics = camera(60.0)
    low = seen_by(optics, 0, *places(0), side_m=0.3, height_m=0.0)
    high = seen_by(optics, 1, *places(1), side_m=0.1, height_m=0.6)
    for number, track in enumerate(from_above([low, high], SIZE_PX)):
        assert unlike(track.positions, places(number)[0]) < 0.01


def test_a_wide_lens_is_straightened_before():
    optics = camera(65.0, radial=(-0.3, 0.1))
    lens = lens_of(optics)
    bent = robots(optics)
    straight = [straightened_track(track, lens, flipped=False) for track in bent]
    true_xy_m = places(0)[0]
    assert unlike(from_above(straight, SIZE_PX, lens)[0].positions, true_xy_m) < 0.01
    # Without a calibration the tilt takes over some of what the lens does.
    assert unlike(from_above(bent, SIZE_PX)[0].positions, true_xy_m) < 0.3 * unlike(bent[0].positions, true_xy_m)


def test_markers_keep_their_size_in_the_picture():
    tracks = robots(camera(60.0))
    plane = ground_plane(tracks, SIZE_PX)
    before, after = (
        np.concatenate([track.corners for track in some]) for some in (tracks, [plane.applied(one) for one in tracks])
    )
    assert after.mean(axis=(0, 1)) == pytest.approx(before.mean(axis=(0, 1)), abs=1.0)
    longest, all_alike = (
        np.linalg.norm(quads - np.roll(quads, 1, axis=1), axis=2).max(axis=1) for quads in (before, after)
    )
    assert np.std(all_alike) < 0.02 * np.mean(all_alike)
    assert 0.5 * longest.mean() < np.mean(all_alike) < 1.2 * longest.mean()


@pytest.mark.parametrize(
    "tracks",
    [
        robots(camera(0.0)),
        robots(camera(3.0), noise_px=0.3),
        [replace(track, corners=None) for track in robots(camera(60.0))],
        [seen_by(camera(60.0), 0, *places(0, 20))],
        [],
    ],
    ids=["from above", "nearly", "no markers", "few", "nothing"],
)
def test_what_shows_no_angle_stays_as_it_is(tracks):
    told = []
    above = from_above(tracks, SIZE_PX, warn=told.append)
    assert told == []
    for before, after in zip(tracks, above, strict=True):
        assert np.array_equal(after.positions, before.positions)
        assert after.corners is None


def test_markers_on_the_floor_and_on_a_wall_have_no_plane():
    floor, wall = robots(camera(60.0)), seen_by(camera(0.0), 7, *places(7))
    upright = [replace(wall, name=f"marker{number}") for number in range(7, 10)]
    assert ground_plane([*floor, *upright], SIZE_PX) is None


def test_what_lies_beyond_the_horizon_is_not_seen_from_above():
    optics = camera(70.0)
    far = replace(robots(optics)[0], name="poster", corners=None)
    positions = far.positions.copy()
    positions[:5, 1] = 5000.0
    *_, poster = from_above([*robots(optics), replace(far, positions=positions)], SIZE_PX)
    assert np.flatnonzero(~poster.valid).tolist() == list(range(5))


def test_the_angle_is_told():
    told = []
    from_above(robots(camera(60.0)), SIZE_PX, warn=told.append)
    words = "the camera looked 60 degrees away from straight down, by the shapes of the markers"
    assert told == [f"{words}; tracks are as seen from above"]


def test_a_message_is_stronger_from_above():
    key = key_of(scheme_of(symbols=(2,), ticks=400))
    own = robot_track(key, "robot0", (1, 3), 9.0, onset_s=0.5, rate_hz=25.0)
    optics = camera(70.0)
    seen = replace(seen_by(optics, 0, own.positions, np.zeros(len(own.times_s))), name="robot0")
    (above,) = from_above([seen], SIZE_PX, lens_of(optics))
    from_the_side, from_there = (
        decode_tracks([track], key, DecodeSettings(onset_s=0.5)).evidence.nats for track in (seen, above)
    )
    assert from_there > 1.05 * from_the_side


def test_a_film_from_above_is_read_as_before():
    film = [
        replace(frame, image=cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY))
        for frame in frames([(marker(number=3), (90, 80), True)], size=SIZE)
    ]
    kept = []
    (track,) = tracked(film, "aruco", keep=kept.append)
    assert np.array_equal(track.positions, kept[0].tracks[0].positions)
    assert kept[0].tracks[0].corners.shape == (len(film), 4, 2)
    middle = kept[0].tracks[0].corners.mean(axis=1)
    assert middle == pytest.approx(track.positions, abs=0.05)
