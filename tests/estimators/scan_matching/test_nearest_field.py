"""The field knows of every cell which point is nearest, and only within reach."""

import numpy as np
import pytest

from grouser.estimators.scan_matching.nearest_field import nearest_field, nearest_to, tile_at

REACH, CELL = 0.3, 0.05


@pytest.mark.parametrize("count", [1, 2, 300])
def test_each_cell_names_the_point_nearest_to_its_centre(count: int) -> None:
    points = np.random.default_rng(count).uniform(-3.0, 2.0, size=(count, 2))
    field = nearest_field(points, REACH, CELL)
    found = 0
    for i, j in np.ndindex(120, 120):
        centre = field.low + CELL * (np.array([i, j]) + 0.5)
        squared = ((points - centre) ** 2).sum(axis=1)
        k = nearest_to(field, *centre)
        if k < 0:
            assert squared.min() > REACH**2 - 1e-6
            continue
        found += 1
        tile, row, column = tile_at(field, *centre)
        assert squared[k] == pytest.approx(squared.min(), abs=1e-6)
        assert field.squared[tile, row, column] == pytest.approx(squared[k], abs=1e-6)
        assert squared[k] <= REACH**2 + 1e-6
    assert found >= 100  # a disc of a radius of 6 cells


def test_nothing_is_near_where_there_are_no_points_or_outside_the_grid() -> None:
    empty = nearest_field(np.empty((0, 2)), REACH, CELL)
    one = nearest_field(np.zeros((1, 2)), REACH, CELL)
    for field, x in ((empty, 0.0), (one, 5.0), (one, -5.0), (one, np.nan)):
        assert nearest_to(field, x, 0.0) == -1
