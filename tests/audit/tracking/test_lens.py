"""Lenses that distort: places, headings and the background as one that does not would have shown them."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.live.judging import Seen, judge
from mtm_audit.live.looks import final_look
from mtm_audit.live.watching import Film
from mtm_audit.model.lens import Lens
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Track
from mtm_audit.tracking.background import BackgroundFollower, Key, Look
from mtm_audit.tracking.following import following
from mtm_audit.tracking.lens import check_fits, straightened, straightened_background, straightened_track
from mtm_audit.tracking.registry import tracker
from mtm_audit.tracking.stabilise import stabilised_tracks
from mtm_onboard.protocol import MtmError
from tests.audit.moving_robot import key_of, scheme_of
from tests.audit.readers.calibrations import CENTRE_PX, FISHEYE, FOCAL_PX, RADIAL, SIZE_PX
from tests.audit.small_films import frames, marker

LENS = Lens(name="cam0.yaml", size_px=SIZE_PX, focal_px=FOCAL_PX, centre_px=CENTRE_PX, distortion=RADIAL)
LENSES = {
    "radial": LENS,
    "rational": replace(LENS, distortion=(*RADIAL, 0.01, 0.02, -0.01, 0.002)),
    "fisheye": replace(LENS, distortion=FISHEYE, model="fisheye"),
}
columns, rows = st.floats(0.0, SIZE_PX[0] - 1.0), st.floats(0.0, SIZE_PX[1] - 1.0)


def distorted(points, lens):
    """Where the lens shows what one without distortion shows at `points` (n, 2), by the formulas of OpenCV's manual."""
    (x, y) = ((points - np.array(lens.centre_px)) / lens.focal_px).T
    radius = np.hypot(x, y)
    if lens.model == "fisheye":
        angle, (k1, k2, k3, k4) = np.arctan(radius), lens.distortion
        bent = angle * (1 + k1 * angle**2 + k2 * angle**4 + k3 * angle**6 + k4 * angle**8)
        x, y = x * bent / radius, y * bent / radius
    else:
        k1, k2, p1, p2, k3, k4, k5, k6 = (*lens.distortion, 0.0, 0.0, 0.0, 0.0)[:8]
        scale = (1 + k1 * radius**2 + k2 * radius**4 + k3 * radius**6) / (
            1 + k4 * radius**2 + k5 * radius**4 + k6 * radius**6
        )
        x, y = (
            x * scale + 2 * p1 * x * y + p2 * (radius**2 + 2 * x**2),
            y * scale + p1 * (radius**2 + 2 * y**2) + 2 * p2 * x * y,
        )
    return np.column_stack([x, y]) * lens.focal_px + lens.centre_px


@pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)
def test_every_place_of_the_picture_leads_back_to_it(lens):
    places = np.stack(np.meshgrid(np.linspace(0.0, 751.0, 12), np.linspace(0.0, 479.0, 9)), axis=-1)
    straight = straightened(places, lens)
    assert straight.shape == places.shape
    assert np.abs(distorted(straight.reshape(-1, 2), lens) - places.reshape(-1, 2)).max() < 0.021
    corner = straight[0, 0] - places[0, 0]
    # The corners lie farther out than a lens with a barrel's distortion shows them.
    assert corner[0] < -50.0
    assert corner[1] < -30.0


@given(columns, rows)
def test_what_the_lens_bends_is_straight_again(column, row):
    point = np.array([[column, row]])
    assert np.abs(straightened(distorted(point, LENS), LENS) - point).max() < 1e-3


def test_a_lens_without_distortion_changes_nothing():
    points = np.array([[0.0, 0.0], [300.5, 20.25], [751.0, 479.0], [np.nan, 3.0]])
    for model in ("radial", "fisheye"):
        straight = straightened(points[:1], replace(LENS, distortion=(0.0,) * 4, model=model))
        assert np.isfinite(straight).all()
    straight = straightened(points, replace(LENS, distortion=(0.0,) * 5))
    assert straight[:3] == pytest.approx(points[:3], abs=1e-9)
    assert np.isnan(straight[3]).all()


def test_where_the_calibration_folds_nothing_is_known():
    folding = replace(LENS, distortion=(-0.6, 0.0, 0.0, 0.0))
    straight = straightened(np.array([[367.0, 248.0], [400.0, 240.0], [751.0, 479.0]]), folding)
    assert np.isfinite(straight).all(axis=1).tolist() == [True, True, False]
    backward = replace(LENS, distortion=(5.0, -3.0, 0.2, 1.0), model="fisheye")
    assert np.isnan(straightened(np.array([[5000.0, 248.0]]), backward)).all()


def line(flipped=False):
    """A body that moves along a straight line and looks along it, as the lens shows it; and that line."""
    true = np.column_stack([np.linspace(40.0, 700.0, 60), np.linspace(30.0, 200.0, 60)])
    seen = distorted(true, LENS)
    beside = distorted(true + 1e-4 * np.array([660.0, 170.0]) / np.hypot(660.0, 170.0), LENS)
    up, across = SIZE_PX[1] - 1.0 - seen[:, 1], SIZE_PX[0] - 1.0 - seen[:, 0] if flipped else seen[:, 0]
    along = (beside - seen) * [-1.0 if flipped else 1.0, -1.0]
    positions, valid = np.column_stack([across, up]), np.ones(60, dtype=bool)
    headings = np.arctan2(along[:, 1], along[:, 0])
    return Track("robot0", np.arange(60) / 30.0, positions, valid, unit="px", headings_rad=headings, extent_px=40.0)


@pytest.mark.parametrize("flipped", [False, True])
def test_a_straight_path_is_straight_and_looked_along(flipped):
    bent = line(flipped)
    straight = straightened_track(bent, LENS, flipped=flipped)
    way = straight.positions[-1] - straight.positions[0]
    across = np.array([-way[1], way[0]]) / np.hypot(*way)
    assert np.abs((straight.positions - straight.positions[0]) @ across).max() < 1e-3
    assert np.abs((bent.positions - bent.positions[0]) @ across).max() > 5.0
    assert np.abs(np.exp(1j * straight.headings_rad) - np.exp(1j * np.arctan2(way[1], way[0]))).max() < 0.005
    # Near the edge things are larger than they were shown.
    assert 1.2 * 40.0 < straight.extent_px < 3.0 * 40.0


def test_what_was_not_seen_stays_unseen():
    bent = line()
    positions, valid = bent.positions.copy(), bent.valid.copy()
    positions[10:20], valid[10:20] = np.nan, False
    straight = straightened_track(replace(bent, positions=positions, valid=valid), LENS, flipped=False)
    assert np.flatnonzero(~straight.valid).tolist() == list(range(10, 20))


def test_points_of_the_background_are_straightened_or_dropped():
    folding = replace(LENS, distortion=(-0.6, 0.0, 0.0, 0.0))
    points = np.array([[300.0, 200.0], [751.0, 479.0], [420.0, 260.0]])
    places = np.array([[301.0, 200.0], [np.nan, np.nan], [421.0, 260.0]], np.float32)
    seen = BackgroundFollower(size=SIZE_PX, times_s=[0.0])
    seen.keys, seen.looks = [Key(0, np.zeros((1, 1), np.uint8), points, np.eye(3))], [Look(0, 0, places)]
    straight = straightened_background(seen, folding)
    assert straight.keys[0].points == pytest.approx(straightened(points[[0, 2]], folding))
    assert straight.looks[0].places == pytest.approx(straightened(places[[0, 2]], folding), abs=1e-3)
    assert seen.keys[0].points is points


def test_a_film_of_another_size_is_refused_at_its_first_picture():
    picture = Frame(0.0, np.zeros((480, 640), np.uint8))
    words = "cam0.yaml is of pictures of 752 x 480, and the film's are of 640 x 480; give the calibration of this size"
    with pytest.raises(MtmError, match=words):
        check_fits(picture, LENS)
    seen = []

    def counted():
        for number in range(100):
            seen.append(number)
            yield picture

    with pytest.raises(MtmError, match=words):
        stabilised_tracks(tracker("aruco"), counted(), lens=LENS)
    assert len(seen) == 1


def test_tracks_of_a_film_are_straightened_first():
    film = [
        replace(frame, image=cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY))
        for frame in frames([(marker(number=3), (150, 120), True)], size=SIZE_PX)
    ]
    (bent,), (straight,) = (stabilised_tracks(tracker("aruco"), film, lens=lens) for lens in (None, LENS))
    expected = straightened_track(bent, LENS, flipped=False)
    assert straight.positions == pytest.approx(expected.positions)
    assert np.abs(straight.positions - bent.positions).max() > 1.0
    told = []
    folding = replace(LENS, distortion=(-3.0, 0.0, 0.0, 0.0))
    stabilised_tracks(tracker("aruco"), film, warn=told.append, lens=folding)
    assert "cam0.yaml does not reach" in told[0]


def test_a_watch_straightens_what_it_judges_and_knows_its_size():
    film = Film(following("aruco"), lens=LENS)
    with pytest.raises(MtmError, match="cam0.yaml is of pictures of 752 x 480"):
        film.put(Frame(0.0, np.zeros((480, 640), np.uint8)))
    assert film.seen(0.0, 1.0).lens is LENS
    bent, background = line(), BackgroundFollower(is_needed=False, size=SIZE_PX)
    seen = Seen((bent,), background, lens=LENS)
    (judged,) = judge(final_look(2.0), seen, key_of(scheme_of(symbols=(1,))), DecodeSettings()).tracks
    assert judged.positions == pytest.approx(straightened_track(bent, LENS, flipped=False).positions)


def test_opencv_agrees_about_a_whole_picture():
    """The middle of a dot is where OpenCV's own undistorted picture shows it."""
    picture = np.zeros((SIZE_PX[1], SIZE_PX[0]), np.uint8)
    place = (120.0, 90.0)
    cv2.circle(picture, (120, 90), 6, 255, -1, cv2.LINE_AA)
    matrix = np.array([[FOCAL_PX[0], 0.0, CENTRE_PX[0]], [0.0, FOCAL_PX[1], CENTRE_PX[1]], [0.0, 0.0, 1.0]])
    shown = cv2.undistort(picture, matrix, np.array(RADIAL)).astype(float)
    rows_px, columns_px = np.indices(shown.shape)
    middle = [float((axis * shown).sum() / shown.sum()) for axis in (columns_px, rows_px)]
    assert straightened(np.array([place]), LENS)[0] == pytest.approx(middle, abs=0.3)
