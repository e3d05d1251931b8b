from dataclasses import asdict

import pytest

from hil.experiments.cameras.tilted import VIEWS, WAYS, View, film_and_read, rows_of, tilted_cells


def test_each_view_films_the_same_runs():
    plans = tilted_cells(2, 10)
    assert [dict(plan[0].parameters) for plan in plans] == [asdict(view) for view in VIEWS]
    assert all([cell.seed for cell in plan] == [10, 11] for plan in plans)


def test_rows_are_means_over_the_runs_of_a_view():
    rows = rows_of([[dict.fromkeys(WAYS, 100.0), dict.fromkeys(WAYS, 130.0)] for _ in VIEWS])
    assert [row.view for row in rows] == list(VIEWS)
    assert rows[0].nats == dict.fromkeys(WAYS, 115.0)
    assert rows[0].rollouts == 2


@pytest.mark.slow
def test_from_the_side_the_view_from_above_shows_more():
    nats = film_and_read(asdict(View(70.0, "pinhole")), 900_000)
    assert nats["above"] > 1.08 * nats["plain"]
    assert nats["straightened"] == pytest.approx(nats["plain"], abs=1.0)
