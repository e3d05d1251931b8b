"""From three dimensions to the floor."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mtm_audit.readers.logs.options import AXES
from mtm_audit.readers.logs.orientation import (
    heading_axis_of,
    headings_at,
    headings_of_quaternions,
    horizontal,
    matrices_of_quaternions,
    quaternions_of_euler,
    quaternions_of_matrices,
    quaternions_of_rotation_vectors,
    stands_upright,
)

# Where the axis that points up is in each frame.
UP_VECTORS = {
    name: np.array([(-1.0 if name.startswith("-") else 1.0) * (axis == name[-1]) for axis in "xyz"]) for name in AXES
}
angles = st.floats(-3.0, 3.0)


def off(first, second):
    return np.abs(np.angle(np.exp(1j * (np.asarray(first) - second)))).max()


@pytest.mark.parametrize("up", AXES)
def test_the_floor_is_seen_from_above(up):
    first, second = np.eye(3)[[np.argmax(np.abs(column)) for column in horizontal(np.eye(3), up).T]]
    signs = horizontal(np.array([first, second]), up).sum(axis=0)
    assert np.cross(signs[0] * first, signs[1] * second) == pytest.approx(UP_VECTORS[up])
    assert horizontal(UP_VECTORS[up][None], up).tolist() == [[0.0, 0.0]]


@pytest.mark.parametrize("up", AXES)
def test_a_turn_about_the_axis_up_is_a_turn_to_the_left(up):
    yaws = np.linspace(-3.0, 3.0, 25)
    turned = Rotation.from_rotvec(yaws[:, None] * UP_VECTORS[up]).as_quat()
    headings = headings_of_quaternions(turned, up, heading_axis_of(turned, up))
    assert off(headings - headings[0], yaws - yaws[0]) < 1e-9


@given(angles, angles, angles)
def test_however_a_sensor_is_mounted_its_turns_are_the_bodys(first, second, third):
    mounting = Rotation.from_euler("xyz", [first, second, third])
    yaws = np.linspace(-1.0, 1.0, 9)
    turned = (Rotation.from_euler("z", yaws[:, None]) * mounting).as_quat()
    headings = headings_of_quaternions(turned, "z", heading_axis_of(turned, "z"))
    assert off(headings - headings[0], yaws - yaws[0]) < 1e-6


def direction(axis):
    return (-1.0 if axis.startswith("-") else 1.0) * np.eye(3)["xyz".index(axis[-1])]


def swaying(tilt_deg=10.0):
    """A body that turns, leans about x and y, and looks along its x axis."""
    phases = np.linspace(0.0, 6.0, 40)
    leans = np.deg2rad(tilt_deg) * np.stack([np.sin(2.0 * phases), np.cos(3.0 * phases)], axis=1)
    return Rotation.from_euler("zyx", np.stack([phases, leans[:, 0], leans[:, 1]], axis=1))


@given(st.sampled_from(range(24)), st.sampled_from(AXES), st.sampled_from(AXES))
def test_a_body_turned_in_its_frame_keeps_its_headings(mounting, axis, up):
    # Columns are the old frame's axes in the new one: each old axis is one of the new ones, or opposite to it.
    turn = Rotation.create_group("O")[mounting]
    new_axis = next(name for name in AXES if np.allclose(turn.apply(direction(axis)), direction(name)))
    # No axis is upright at any time, where the smallest rounding would turn it.
    poses = swaying() * Rotation.from_euler("xyz", [0.5, 0.6, 0.7])
    before = headings_of_quaternions(poses.as_quat(), up, axis)
    after = headings_of_quaternions((poses * turn.inv()).as_quat(), up, new_axis)
    assert off(after, before) < 1e-6


@given(angles, angles, angles)
def test_opposite_axes_look_opposite_ways(first, second, third):
    rows = Rotation.from_euler("xyz", [[first, second, third]]).as_quat()
    for axis in "xyz":
        there, back = (headings_of_quaternions(rows, "z", name) for name in (axis, f"-{axis}"))
        assert off(there, back + np.pi) < 1e-9


@pytest.mark.parametrize(
    ("leaning", "axis"),
    [
        ((0.0, 0.0, 0.0), "x"),
        ((0.0, 10.0, 0.0), "x"),
        ((0.0, 20.0, 0.0), "y"),
        ((0.0, 90.0, 0.0), "y"),
        ((70.0, 90.0, 0.0), "y"),
        ((35.0, 60.0, 0.0), "y"),
        ((80.0, 60.0, 0.0), "z"),
    ],
    ids=["level", "x a little", "x more", "x upright", "rolled", "none level", "rolled far"],
)
def test_the_axis_that_lies_level_gives_the_heading(leaning, axis):
    yaws = Rotation.from_euler("z", np.linspace(0.0, 6.0, 30)[:, None])
    rows = (yaws * Rotation.from_euler("ZYX", (leaning[2], leaning[1], leaning[0]), degrees=True)).as_quat()
    assert heading_axis_of(rows, "z") == axis


def test_an_axis_that_stands_upright_is_told():
    rows = swaying(3.0).as_quat()
    assert [stands_upright(rows, "z", axis) for axis in AXES] == [axis[-1] == "z" for axis in AXES]
    assert not stands_upright(swaying(30.0).as_quat(), "z", "z")


def test_a_quaternion_of_any_length_is_a_rotation():
    yaw = np.array([0.0, 0.0, np.sin(0.35), np.cos(0.35)])
    rows = np.array([yaw, 5.0 * yaw, -1e200 * yaw, 0.0 * yaw, np.nan * yaw])
    headings = headings_of_quaternions(rows, "z", "x")
    assert headings[:3] == pytest.approx(0.7)
    assert np.isnan(headings[3:]).all()


@given(angles, angles, angles)
def test_conversions_agree_with_each_other(first, second, third):
    rotation = Rotation.from_euler("XYZ", [[first, second, third]])
    matrices = rotation.as_matrix()
    for quaternions in (
        quaternions_of_euler(np.array([[first, second, third]]), "XYZ"),
        quaternions_of_rotation_vectors(rotation.as_rotvec()),
        quaternions_of_matrices(matrices),
    ):
        assert matrices_of_quaternions(quaternions) == pytest.approx(matrices, abs=1e-9)


def test_what_is_no_rotation_has_no_quaternion():
    matrices = np.array([np.eye(3), np.zeros((3, 3)), np.full((3, 3), np.nan), -np.eye(3)])
    assert np.isfinite(quaternions_of_matrices(matrices)).all(axis=1).tolist() == [True, False, False, False]
    assert np.isnan(quaternions_of_rotation_vectors(np.array([[np.inf, 0.0, 0.0]]))).all()


def test_headings_between_measured_ones_go_the_short_way():
    known_s, headings = np.array([0.0, 0.1, 0.2]), np.array([3.1, -3.1, -3.0])
    found = headings_at(np.array([0.05, 0.2, 0.6, 0.8]), known_s, headings)
    assert off(found[0], np.pi) < 1e-9
    assert off(found[1:3], -3.0) < 1e-9
    assert np.isnan(found[3])
    assert np.isnan(headings_at(np.array([0.0]), np.array([]), np.array([]))).all()
    assert headings_at(np.array([0.0]), np.array([0.1]), np.array([1.0])).tolist() == [1.0]
