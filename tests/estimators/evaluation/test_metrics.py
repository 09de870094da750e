"""Metrics agree with evo, and follow the laws that their names promise."""

import numpy as np
import pytest
from evo.core import lie_algebra, metrics
from evo.core.geometry import umeyama_alignment
from evo.core.trajectory import PosePath3D

from grouser.estimators.evaluation.metrics import (
    ate_se2,
    ate_se3,
    distances,
    drift,
    relative_errors,
    rpe,
)
from grouser.geometry import Array, compose, lift, rotation_from_rpy, transform

N = 120


def planar_course(step: Array, noise: float, seed: int) -> Array:
    """(N, 3) from the same body motion over and over, disturbed."""
    rng = np.random.default_rng(seed)
    poses = [np.zeros(3)]
    for _ in range(N - 1):
        poses.append(compose(poses[-1], step + rng.normal(0, noise, 3) * [1, 1, 0.5]))
    return np.array(poses)


def spatial_course(noise: float, seed: int) -> Array:
    """(N, 4, 4) that climbs and turns."""
    rng = np.random.default_rng(seed)
    poses = [np.eye(4)]
    for _ in range(N - 1):
        rpy = np.array([0.01, -0.02, 0.05]) + rng.normal(0, noise / 2, 3)
        translation = np.array([0.2, 0.02, 0.01]) + rng.normal(0, noise, 3)
        poses.append(poses[-1] @ transform(rotation_from_rpy(*rpy), translation))
    return np.array(poses)


STEP = np.array([0.2, 0.0, 0.03])
PLANAR = (lift(planar_course(STEP, 0.0, 0)), lift(planar_course(STEP, 0.01, 1)))
SPATIAL = (spatial_course(0.0, 0), spatial_course(0.01, 1))
PAIRS = pytest.mark.parametrize(("truth", "estimate"), [PLANAR, SPATIAL], ids=["2-D", "3-D"])


def as_evo(poses: Array) -> PosePath3D:
    return PosePath3D(poses_se3=list(poses))


def evo_rmse(metric: metrics.PE, truth: Array, estimate: PosePath3D) -> float:
    metric.process_data((as_evo(truth), estimate))
    return float(metric.get_statistic(metrics.StatisticsType.rmse))


@PAIRS
def test_ate_se3_agrees_with_evo(truth: Array, estimate: Array) -> None:
    aligned = as_evo(estimate)
    aligned.align(as_evo(truth))
    expected = evo_rmse(metrics.APE(metrics.PoseRelation.translation_part), truth, aligned)
    assert expected > 0.01
    assert ate_se3(truth[:, :3, 3], estimate[:, :3, 3]) == pytest.approx(expected, abs=1e-6)


def test_ate_se2_agrees_with_evo() -> None:
    truth, estimate = (poses[:, :2, 3] for poses in PLANAR)
    R, t, _ = umeyama_alignment(estimate.T, truth.T)
    errors = np.linalg.norm(R @ estimate.T + t[:, None] - truth.T, axis=0)
    expected = float(np.sqrt(np.mean(errors**2)))
    assert expected > 0.01
    assert ate_se2(truth, estimate) == pytest.approx(expected, abs=1e-6)


@PAIRS
def test_rpe_agrees_with_evo(truth: Array, estimate: Array) -> None:
    translation, angle = rpe(truth, estimate)
    relations = metrics.PoseRelation
    expected_m = evo_rmse(metrics.RPE(relations.translation_part), truth, as_evo(estimate))
    expected_deg = evo_rmse(metrics.RPE(relations.rotation_angle_deg), truth, as_evo(estimate))
    assert translation == pytest.approx(expected_m, abs=1e-6)
    assert np.degrees(angle) == pytest.approx(expected_deg, abs=1e-6)


@PAIRS
def test_distance_agrees_with_evo(truth: Array, estimate: Array) -> None:
    assert distances(estimate)[-1] == pytest.approx(as_evo(estimate).path_length, abs=1e-6)


@PAIRS
def test_drift_agrees_with_the_development_kit_of_kitti(truth: Array, estimate: Array) -> None:
    """Its loops, written out, with the errors of segments as evo computes them."""
    along = [0.0]
    for a, b in zip(truth, truth[1:], strict=False):
        along.append(along[-1] + float(np.linalg.norm(b[:3, 3] - a[:3, 3])))
    translations, rotations = [], []
    for first in range(N):
        for length in (5.0, 10.0, 20.0, 40.0):
            last = next((i for i in range(first, N) if along[i] > along[first] + length), None)
            if last is None:
                continue
            error = metrics.RPE.rpe_base(truth[first], truth[last], estimate[first], estimate[last])
            translations.append(np.linalg.norm(error[:3, 3]) / length)
            rotations.append(lie_algebra.so3_log_angle(error[:3, :3], degrees=True) / length)
    found = drift(truth, estimate)
    assert found is not None
    assert found.translation_percent == pytest.approx(100 * np.mean(translations), abs=1e-6)
    assert found.rotation_deg_per_m == pytest.approx(np.mean(rotations), abs=1e-6)


@PAIRS
def test_ate_does_not_see_where_the_frame_is(truth: Array, estimate: Array) -> None:
    T = transform(rotation_from_rpy(0, 0, 2.5), [3, -4, 1])
    p, q, moved = truth[:, :3, 3], estimate[:, :3, 3], (T @ estimate)[:, :3, 3]
    assert ate_se2(p, moved) == pytest.approx(ate_se2(p, q), abs=1e-9)
    T = transform(rotation_from_rpy(0.5, -1, 2.5), [3, -4, 1])
    moved = (T @ estimate)[:, :3, 3]
    assert ate_se3(p, moved) == pytest.approx(ate_se3(p, q), abs=1e-9)


def test_ate_sees_scale() -> None:
    truth = PLANAR[0][:, :3, 3]
    for ate in (ate_se2, ate_se3):
        assert ate(truth, 1.1 * truth) > 0.1


def test_ate_does_not_mirror() -> None:
    """A mirrored course is a wrong one, however well the mirror image fits."""
    truth = SPATIAL[0][:, :3, 3]
    for axis, ate in ((1, ate_se2), (2, ate_se3)):
        mirrored = truth.copy()
        mirrored[:, axis] *= -1
        assert ate(truth, mirrored) > 0.1


def test_ate_of_a_straight_course_exists() -> None:
    """There, evo refuses: the roll about the course is not determined, but does not matter."""
    truth = np.linspace([0, 0, 0], [10, 0, 0], 50)
    estimate = truth @ rotation_from_rpy(0, 0, 0.3).T
    assert ate_se2(truth, estimate) == pytest.approx(0, abs=1e-9)
    assert ate_se3(truth, estimate) == pytest.approx(0, abs=1e-9)


def test_one_percent_of_scale_is_one_percent_of_drift() -> None:
    truth = lift(np.linspace([0, 0, 0], [50, 0, 0], 5001))
    estimate = truth.copy()
    estimate[:, 0, 3] *= 1.01
    found = drift(truth, estimate)
    assert found is not None
    # A segment ends in the first frame beyond its length, up to 1 cm further on.
    assert found.translation_percent == pytest.approx(1.0, rel=2e-3)
    assert found.rotation_deg_per_m == pytest.approx(0, abs=1e-9)


def test_a_turning_bias_is_the_drift_of_heading() -> None:
    along = np.linspace(0, 50, 5001)
    truth = lift(np.stack([along, 0 * along, 0 * along], axis=1))
    estimate = lift(np.stack([along, 0 * along, np.radians(0.02) * along], axis=1))
    found = drift(truth, estimate)
    assert found is not None
    assert found.rotation_deg_per_m == pytest.approx(0.02, rel=2e-3)


def test_drift_needs_a_segment_that_fits() -> None:
    truth = lift(np.linspace([0, 0, 0], [4.9, 0, 0], 100))
    assert drift(truth, truth) is None
    assert drift(truth, truth, lengths=(4.0,)) is not None


def test_small_angles_keep_their_digits() -> None:
    angles = np.array([0.0, 1e-9, 1e-7, 1e-3, 1.0, 3.0, np.pi])
    turned = lift(np.stack([0 * angles, 0 * angles, angles], axis=1))
    still = np.tile(np.eye(4), (len(angles), 1, 1))
    first, last = np.zeros(len(angles), int), np.arange(len(angles))
    _, found = relative_errors(still, turned, first, last)
    np.testing.assert_allclose(found, angles, rtol=1e-7, atol=1e-15)
