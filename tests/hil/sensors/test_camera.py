import cv2
import numpy as np
import pytest

from hil.sensors.camera import Camera, film, frame_times, top_pixels
from hil.sensors.optics import Optics, overhead
from hil.sensors.poses import Occlusion, Trajectory
from hil.sensors.scene import Scene
from mtm_onboard.protocol import MtmError

OBLIQUE = Optics(
    position_m=(2.6, -2.8, 2.4),
    target_m=(0.1, 0.1, 0.0),
    focal_px=700,
    width_px=640,
    height_px=480,
    roll_rad=0.2,
    radial=(-0.1, 0.01),
)


def still(x=0.5, y=0.3, heading=0.0, name="robot0"):
    return Trajectory(name, np.array([0.0, 1.0]), np.array([[x, y], [x, y]]), np.array([heading, heading]))


def moving(speed_mps=1.0):
    return Trajectory("robot0", np.array([0.0, 1.0]), np.array([[0.0, 0.0], [speed_mps, 0.0]]), np.zeros(2))


def first_picture(camera, scene, trajectories, seed=1):
    return next(film(camera, scene, trajectories, np.random.default_rng(seed))).image


@pytest.mark.parametrize(
    "optics", [overhead(), OBLIQUE, Optics(position_m=(2, 1, 3), target_m=(0, 0, 0), focal_px=600, mirrored=True)]
)
def test_a_point_of_a_plane_is_seen_by_its_own_pixel(optics):
    plane = optics.plane_xy_m(0.2)
    for row, column in ((100, 120), (240, 320), (400, 500)):
        point = np.append(plane[row, column], 0.2)[None]
        assert optics.project(point)[0] == pytest.approx([column, row], abs=1e-6)


def test_from_straight_above_x_points_right_and_y_points_up():
    east, north = overhead().project(np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    centre = (704 - 1) / 2
    assert east[0] > centre + 100
    assert east[1] == pytest.approx(centre)
    assert north[1] < centre - 100


def test_a_rolled_camera_turns_its_picture_the_other_way():
    upright, rolled = (
        Optics(position_m=(0, -3, 2), target_m=(0, 0, 0), focal_px=600),
        Optics(position_m=(0, -3, 2), target_m=(0, 0, 0), focal_px=600, roll_rad=np.pi / 2),
    )
    offsets = [optics.project(np.array([[0.5, 0.0, 0.0]]))[0] - (704 - 1) / 2 for optics in (upright, rolled)]
    assert offsets[0][0] > 50
    assert offsets[1] == pytest.approx([0.0, -offsets[0][0]], abs=1e-6)


def test_pixels_above_the_horizon_see_no_floor():
    plane = Optics(position_m=(0, -3, 1), target_m=(0, 0, 1), focal_px=300).plane_xy_m(0.0)
    assert np.isnan(plane[:300]).all()
    assert np.isfinite(plane[-1]).all()


def test_a_camera_needs_something_to_look_at():
    with pytest.raises(MtmError, match="its own position"):
        Optics(position_m=(0, 0, 1), target_m=(0, 0, 1), focal_px=300)


@pytest.mark.parametrize("optics", [overhead(), OBLIQUE])
def test_a_coloured_top_is_centred_where_the_geometry_puts_it(optics):
    robot = still()
    picture = first_picture(Camera(optics=optics), Scene(colours_bgr=((0, 0, 255),)), [robot]).astype(float)
    red = np.maximum(picture[..., 2] - picture[..., 1] - 20, 0)
    rows, columns = np.indices(red.shape)
    seen = [(red * columns).sum() / red.sum(), (red * rows).sum() / red.sum()]
    # In perspective the centroid of a square is not the image of its middle, but near it.
    tolerance = 0.04 if optics is not OBLIQUE else 0.6
    assert seen == pytest.approx(top_pixels(optics, robot.positions_xy_m)[0], abs=tolerance)


def test_a_mirrored_camera_shows_the_flipped_picture():
    plain = first_picture(Camera(optics=overhead()), Scene(), [still()])
    optics = Optics(position_m=(0.0, 0.0, 5.0), target_m=(0.0, 0.0, 0.0), focal_px=overhead().focal_px, mirrored=True)
    mirrored = first_picture(Camera(optics=optics), Scene(), [still()])
    robot = plain < 60
    assert robot.sum() > 300
    assert np.abs(mirrored[:, ::-1][robot].astype(int) - plain[robot]).mean() < 10
    assert np.abs(mirrored[robot].astype(int) - plain[robot]).mean() > 50


def test_the_nearer_robot_hides_the_one_behind_it():
    optics = Optics(position_m=(0.0, -3.0, 1.0), target_m=(0.0, 0.0, 0.2), focal_px=700)
    near, far = still(0.0, -0.5, name="near"), still(0.0, 0.0, name="far")
    red, blue = (0, 0, 255), (255, 0, 0)
    for order, colours in (([near, far], (red, blue)), ([far, near], (blue, red))):
        alone = first_picture(Camera(optics=optics), Scene(colours_bgr=(red,)), [near])
        both = first_picture(Camera(optics=optics), Scene(colours_bgr=colours), order)
        top = (alone[..., 2] > 200) & (alone[..., 1] < 60)
        assert top.sum() > 50
        assert np.array_equal(both[top], alone[top])


def test_a_long_exposure_smears_what_moves():
    sharp, smeared = (
        first_picture(Camera(exposure_s=exposure_s, sub_exposures=6), Scene(), [moving(2.0)])
        for exposure_s in (0.0, 0.03)
    )
    contrast = [cv2.Laplacian(picture[330:374, 330:374], cv2.CV_64F).std() for picture in (sharp, smeared)]
    assert contrast[1] < 0.9 * contrast[0]


def test_noise_has_the_stated_strength_and_differs_by_frame():
    frames = film(Camera(noise_levels=3.0), Scene(), [still()], np.random.default_rng(1))
    first, second = next(frames).image.astype(float), next(frames).image.astype(float)
    assert (first - second).std() == pytest.approx(3.0 * np.sqrt(2), rel=0.1)


def test_the_same_seed_films_the_same_recording():
    camera = Camera(noise_levels=2.0, jitter_s=0.003, drop_probability=0.2)
    one, same = (list(film(camera, Scene(), [moving()], np.random.default_rng(3), 0.0, 0.3)) for _ in range(2))
    assert [frame.time_s for frame in one] == [frame.time_s for frame in same]
    assert all(np.array_equal(a.image, b.image) for a, b in zip(one, same, strict=True))


def test_frames_jitter_and_drop_at_the_stated_rate():
    regular = frame_times(Camera(), 10.0, np.random.default_rng(1))
    assert regular == pytest.approx(np.arange(301) / 30)
    irregular = frame_times(Camera(jitter_s=0.005, drop_probability=0.2), 100.0, np.random.default_rng(1))
    assert np.all(np.diff(irregular) > 0)
    assert len(irregular) / 3001 == pytest.approx(0.8, abs=0.03)
    assert np.std(irregular * 30 - np.round(irregular * 30)) / 30 == pytest.approx(0.005, rel=0.1)


def test_an_occluded_robot_shows_no_marker():
    camera = Camera(occlusions=(Occlusion("robot0", 0.0, 0.5),))
    pictures = [first_picture(one, Scene(), [still()]) for one in (Camera(), camera)]
    centre = np.round(top_pixels(camera.optics, still().positions_xy_m)[0]).astype(int)
    patches = [picture[centre[1] - 10 : centre[1] + 10, centre[0] - 10 : centre[0] + 10] for picture in pictures]
    assert patches[0].std() > 50
    assert patches[1].std() < 5


def test_a_robot_behind_the_camera_or_out_of_view_is_left_out():
    scene = Scene()
    for optics in (overhead(), Optics(position_m=(0.0, -1.0, 1.0), target_m=(0.0, 3.0, 0.0), focal_px=500)):
        seen = first_picture(Camera(optics=optics), scene, [still(0.0, -9.0)])
        assert np.array_equal(seen, first_picture(Camera(optics=optics), scene, [still(0.0, -12.0)]))


def test_more_robots_than_markers_are_refused():
    with pytest.raises(MtmError, match="50 markers"):
        next(film(Camera(), Scene(), [still(name=f"robot{k}") for k in range(51)], np.random.default_rng(1)))
