import numpy as np
import pytest

from hil.plants.robots import path
from hil.worlds.open_loop import cruise, pick_and_place, spinning, steering, stop_and_go, wander, zigzag

COUNT, STEP_S = 3000, 0.01


def driven(task):
    return task(COUNT, STEP_S, np.random.default_rng(4))


@pytest.mark.parametrize("task", [zigzag, wander, stop_and_go, steering, spinning, pick_and_place, cruise])
def test_a_task_fills_its_run_and_differs_with_the_draw(task):
    velocities = driven(task)
    assert velocities.shape == (COUNT, 3)
    assert np.array_equal(velocities, driven(task))
    assert not np.array_equal(velocities, task(COUNT, STEP_S, np.random.default_rng(5)))


def test_a_zigzag_has_one_speed_and_legs_of_a_second_or_more():
    velocities = driven(zigzag)
    assert np.hypot(*velocities[:, :2].T) == pytest.approx(0.5)
    turns = np.flatnonzero(np.any(np.diff(velocities, axis=0), axis=1))
    assert np.diff(turns).min() >= 1.0 / STEP_S
    assert len(turns) >= 5


def test_stop_and_go_stands_about_half_of_the_time():
    assert 0.3 < np.mean(np.all(driven(stop_and_go) == 0.0, axis=1)) < 0.7


def test_steering_never_goes_sideways():
    assert np.all(driven(steering)[:, 1] == 0.0)


def test_a_spinning_body_goes_where_a_smooth_course_leads():
    course = np.cumsum(driven(wander)[:, :2], axis=0) * STEP_S
    assert np.abs(path(driven(spinning), STEP_S)[:, :2] - course).max() < 1e-9


def test_a_tool_stays_at_its_place_of_work():
    path_m = np.cumsum(driven(pick_and_place)[:, :2], axis=0) * STEP_S
    assert np.abs(path_m).max() < 0.16
    assert np.ptp(path_m, axis=0).min() > 0.1


def test_a_heavy_vehicle_can_follow_its_course():
    velocities = cruise(60_000, STEP_S, np.random.default_rng(4))[:, :2]
    assert velocities.std(axis=0) == pytest.approx([0.35, 0.35], rel=0.15)
    assert np.sqrt(np.mean(np.square(np.diff(velocities, axis=0)))) / STEP_S == pytest.approx(0.22, rel=0.1)
