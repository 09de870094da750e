"""The most likely line: exact without noise, and as far off as its covariance says with it."""

import numpy as np
import pytest

from grouser.estimators.line_slam.line_fit import fit_line
from grouser.estimators.line_slam.lines import line_through
from grouser.estimators.line_slam.returns import returns_of
from grouser.estimators.line_slam.scan import ScanReader
from grouser.geometry import Array
from tests.estimators.line_slam.walls import lidar, seen

WALL = np.array([[[2.5, -2.0], [4.5, 3.0]]])
SENSOR = lidar(60, fov=1.2, start=-0.6, sigma_range=0.03, sigma_bearing=0.004)


def fitted(ranges: Array) -> tuple[Array, Array, float]:
    returns = returns_of(ScanReader(SENSOR).read(ranges), SENSOR.sigma_range, SENSOR.sigma_bearing)
    line, covariance, chi2 = fit_line(returns.points, returns.by_range, returns.by_bearing)
    return line, covariance, chi2


@pytest.mark.parametrize("far", [0.0, 60.0])
def test_without_noise_the_line_is_exact(far: float) -> None:
    points = np.linspace([far, 3.0], [far + 2.0, 7.0], 12)
    ones = np.ones((12, 2)) * [0.01, 0.002]
    line, _, chi2 = fit_line(points, ones, ones[:, ::-1].copy())
    truth = line_through(points[0], points[-1])
    np.testing.assert_allclose(np.abs(line[0]), np.abs(truth[0]), atol=1e-11)
    np.testing.assert_allclose(np.sin(line[1] - truth[1]), 0, atol=1e-12)
    assert chi2 < 1e-15


def test_the_covariance_is_that_of_monte_carlo_and_the_nees_that_of_two_numbers() -> None:
    rng = np.random.default_rng(1)
    truth = line_through(*WALL[0])
    lines, covariances, chi2 = [], [], []
    for _ in range(20_000):
        line, covariance, cost = fitted(seen(WALL, SENSOR, rng=rng))
        lines.append(line)
        covariances.append(covariance)
        chi2.append(cost)
    errors = np.array(lines) - truth
    told, found = np.mean(covariances, axis=0), np.cov(errors.T)
    scale = np.sqrt(np.outer(np.diag(told), np.diag(told)))
    # A variance of 20,000 samples has a standard error of 1 %.
    np.testing.assert_allclose(found / scale, told / scale, atol=0.03)
    nees = np.einsum("ni,nij,nj->n", errors, np.linalg.inv(covariances), errors)
    assert 1.94 < nees.mean() < 2.06
    assert abs(np.mean(chi2) / 58 - 1) < 0.01
