from dataclasses import asdict

import pytest

from hil.experiments.cameras.filmed import ANGLE, CONDITIONS, STILL, Condition, camera_cells, film_and_decode, rows_of


def results(bits_of):
    return [[{"bits": bits_of(condition), "right": True, "seen": 1.0}] for condition in CONDITIONS]


def test_each_condition_films_the_same_runs():
    plans = camera_cells(2, 10)
    assert len(plans) == len(CONDITIONS)
    assert all([cell.seed for cell in plan] == [10, 11] for plan in plans)


def test_shares_are_of_the_still_camera_over_the_same_floor():
    still = {"mat": 100.0, "carpet": 50.0, "markers": 200.0}
    rows = rows_of(results(lambda condition: still[condition.floor] if condition.what == STILL else 40.0))
    shares = {(row.condition.what, row.condition.floor, row.condition.shake_px): row.share for row in rows}
    assert shares["shake", "carpet", 3.0] == 0.8
    assert shares["shake", "markers", 3.0] == 0.2


def test_shares_of_angles_are_of_the_best_angle():
    rows = rows_of(results(lambda condition: 100.0 - condition.angle_deg))
    shares = [row.share for row in rows if row.condition.what == ANGLE]
    assert (shares[0], shares[-1]) == (1.0, 0.55)


@pytest.mark.slow
def test_a_shaking_camera_keeps_most_of_the_evidence():
    still, shaken = (
        film_and_decode(asdict(condition), 900_001)
        for condition in (Condition(STILL, "carpet"), Condition("shake", "carpet", shake_px=10.0))
    )
    assert still["right"]
    assert shaken["right"]
    assert shaken["bits"] > 0.7 * still["bits"]
