"""Lines through noisy ends: exact without noise, and their covariance is that of Monte Carlo."""

import numpy as np
import pytest

from grouser.estimators.line_slam.endpoint_sensor import measure_lines
from grouser.estimators.line_slam.lines import points_on
from grouser.geometry import Array
from grouser.rig_motion import LineSensor

SENSOR = LineSensor(range_max=30.0, sigma_range=0.1, sigma_bearing=np.radians(1), max_lines=3)
ENDS = np.array([[12.0, -6.0], [9.0, 11.0]])


def polar(ends: Array) -> Array:
    ranges, bearings = np.linalg.norm(ends, axis=-1), np.arctan2(ends[..., 1], ends[..., 0])
    return np.stack([ranges, bearings], axis=-1).reshape(*ends.shape[:-2], 4)


def test_a_line_goes_through_its_ends_with_its_normal_away_from_the_robot() -> None:
    seen = measure_lines(np.array([polar(ENDS), np.zeros(4)]), SENSOR)
    assert len(seen) == 1 and seen.lines[0, 0] > 0
    n = np.array([np.cos(seen.lines[0, 1]), np.sin(seen.lines[0, 1])])
    np.testing.assert_allclose(ENDS @ n, seen.lines[0, 0], atol=1e-12)
    np.testing.assert_allclose(seen.ends[0], ENDS, atol=1e-12)
    assert not seen.open_ends.any()


def test_ends_at_the_range_limit_are_open() -> None:
    far = points_on(np.array([10.0, 0.3]), np.array([-5.0, np.sqrt(30.0**2 - 10.0**2)]))
    assert measure_lines(polar(far)[None], SENSOR).open_ends.tolist() == [[False, True]]


def test_covariance_is_that_of_monte_carlo() -> None:
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(20_000, 4)) * np.tile([0.1, SENSOR.sigma_bearing], 2)
    seen = measure_lines(polar(ENDS) + noise, SENSOR)
    expected = measure_lines(polar(ENDS)[None], SENSOR).covariances[0]
    found = np.cov(seen.lines.T)
    np.testing.assert_allclose(np.diag(found), np.diag(expected), rtol=0.04)
    largest = np.sqrt(expected[0, 0] * expected[1, 1])
    assert found[0, 1] == pytest.approx(expected[0, 1], abs=0.02 * largest)


def test_what_is_no_row_of_ends_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"must be finite rows of range and bearing .* shape \(3,\)"
    ):
        measure_lines(np.zeros(3), SENSOR)
