"""How uneven walls are is learnt from how well lines fit, and from nothing else."""

import numpy as np
import pytest

from grouser.estimators.line_slam.lines import line_through
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.unevenness import Unevenness, of_uneven
from grouser.geometry import Array

ENDS = np.array([[[3.0, -1.0], [3.0, 2.0]], [[-1.0, 2.0], [-5.0, 2.5]]])
NOISE = np.diag([0.01, 0.004]) ** 2


def seen(n: int = 1) -> LineMeasurements:
    ends = np.tile(ENDS, (n, 1, 1))
    count = len(ends)
    return LineMeasurements(
        line_through(ends[:, 0], ends[:, 1]),
        np.tile(NOISE, (count, 1, 1)),
        ends,
        np.full((count, 2), 0.02),
        np.zeros((count, 2), dtype=np.bool_),
    )


def test_its_covariance_is_that_of_lines_through_ends_that_are_off() -> None:
    rng = np.random.default_rng(0)
    line = line_through(ENDS[0, 0], ENDS[0, 1])
    normal = np.array([np.cos(line[1]), np.sin(line[1])])
    off = 0.01 * rng.standard_normal((20_000, 2, 1)) * normal
    lines = line_through(ENDS[0, 0] + off[:, 0], ENDS[0, 1] + off[:, 1])
    assert np.cov(lines.T) == pytest.approx(1e-4 * of_uneven(seen())[0], rel=0.05, abs=1e-8)


def learnt(sigma: float, rng: np.random.Generator) -> Unevenness:
    """After 60 scans whose residuals are of that unevenness, with a pose that is off for all."""
    unevenness, two = Unevenness(), seen()
    S = np.kron(np.ones((2, 2)), np.diag([0.05, 0.01]) ** 2) + np.kron(np.eye(2), NOISE)
    true: Array = S.copy()
    for i in range(2):
        true[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] += sigma**2 * of_uneven(two)[i]
    for _ in range(60):
        unevenness.learn(rng.multivariate_normal(np.zeros(4), true), S, of_uneven(two))
    return unevenness


@pytest.mark.parametrize("sigma", [0.0, 0.01, 0.03])
def test_it_is_learnt_although_the_pose_is_off_too(sigma: float) -> None:
    found = [learnt(sigma, np.random.default_rng(seed)).sigma for seed in range(5)]
    assert np.mean(found) == pytest.approx(sigma, abs=0.004)


def test_what_is_known_is_not_learnt() -> None:
    even = Unevenness(0.0)
    assert not even.learns and Unevenness().learns
    assert even.sigma == 0 and even.widened(seen()).covariances == pytest.approx(seen().covariances)
    assert Unevenness(0.02).sigma == pytest.approx(0.02)


def test_no_less_is_learnt_than_is_said() -> None:
    unevenness = Unevenness(least=0.01)
    for _ in range(50):
        unevenness.learn(np.zeros(4), np.kron(np.eye(2), NOISE), of_uneven(seen()))
    assert unevenness.sigma == pytest.approx(0.01, abs=1e-3)


def test_a_short_part_tells_little_of_the_direction_a_long_one_much() -> None:
    widened = Unevenness(0.01).widened(seen()).covariances - seen().covariances
    assert widened[0, 1, 1] > 1.5 * widened[1, 1, 1]  # 3 m and 4 m
