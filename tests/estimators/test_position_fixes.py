"""Satellite fixes are taken once each, and carried on to now."""

import numpy as np
import pytest

from grouser.estimators.position_fixes import PositionFixes
from grouser.geometry import Array
from grouser.rig import Gps


def shown(stamp: float, x: float, taken_at: float | None = None) -> dict[str, Array]:
    seen = {"gps": np.array([x, 0.0]), "stamp": np.array([stamp])}
    return seen if taken_at is None else seen | {"gps_stamp": np.array([taken_at])}


def started() -> PositionFixes:
    fixes = PositionFixes(Gps(sigma_position=0.5))
    fixes.reset(shown(0.0, 7.0, 0.0))
    return fixes


def test_a_fix_is_taken_once() -> None:
    fixes, at = started(), np.zeros(2)
    assert fixes.new(shown(0.1, 7.0, 0.0), at) is None
    first = fixes.new(shown(1.0, 3.0, 1.0), at)
    assert first is not None and first.position.tolist() == [3.0, 0.0]
    assert fixes.new(shown(1.1, 3.0, 1.0), at) is None


def test_no_fix_is_none() -> None:
    assert started().new(shown(0.1, np.nan), np.zeros(2)) is None


def test_a_late_fix_is_carried_on_by_the_motion_since() -> None:
    fixes = started()
    for k in range(1, 10):
        assert fixes.new(shown(0.1 * k, 7.0, 0.0), np.array([0.05 * k, 0.0])) is None
    fix = fixes.new(shown(1.0, 0.4, 0.75), np.array([0.5, 0.0]))
    assert fix is not None
    assert fix.position == pytest.approx([0.4 + 0.125, 0.0])
    assert fix.age == pytest.approx(0.25)


def test_a_fix_older_than_all_that_is_remembered_is_of_no_use() -> None:
    fixes = started()
    for k in range(1, 150):
        fixes.new(shown(0.1 * k, 7.0, 0.0), np.zeros(2))
    assert fixes.new(shown(15.0, 1.0, 0.1), np.zeros(2)) is None
