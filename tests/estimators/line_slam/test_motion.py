"""Steering and odometry as predictions: Jacobians against finite differences, and their words."""

import numpy as np
import pytest

from grouser.estimators.line_slam.ackermann import AckermannPredictor, steered, steered_jacobian
from grouser.estimators.line_slam.motion import PredictedMotion, PrintedSteering
from grouser.estimators.line_slam.motion_source import motion_source
from grouser.estimators.line_slam.odometry_predictor import OdometryPredictor
from grouser.geometry import Array
from grouser.rig import Rig
from grouser.rig_motion import Odometry, Steering

STEERING = Steering(
    wheelbase=4.0,
    max_speed=3.0,
    max_angle=0.5,
    max_angle_rate=0.35,
    sigma_speed=0.3,
    sigma_angle=np.radians(3),
)
CONTROL, DT = np.array([2.5, -0.3]), 0.2


def slopes(function: object, at: Array, step: float = 1e-6) -> Array:
    assert callable(function)
    sides = [(function(at + d), function(at - d)) for d in np.eye(len(at)) * step]
    return np.stack([(up - down) / (2 * step) for up, down in sides], axis=-1)


def test_steered_is_eq_5_and_its_jacobian_is_right() -> None:
    x, y, turn = steered(CONTROL, 4.0, DT)
    assert np.hypot(x, y) == pytest.approx(0.5) and np.arctan2(y, x) == pytest.approx(-0.3)
    assert turn == pytest.approx(DT * 2.5 * np.sin(-0.3) / 4.0)
    found = steered_jacobian(CONTROL, 4.0, DT)
    np.testing.assert_allclose(found, slopes(lambda u: steered(u, 4.0, DT), CONTROL), atol=1e-9)


def test_jacobian_by_the_pose_is_eq_6_corrected_and_the_printed_one_is_not() -> None:
    pose, observation = np.array([1.0, 2.0, 0.7]), {"steering": CONTROL}
    right = PredictedMotion(AckermannPredictor(STEERING, DT))
    printed = PrintedSteering(STEERING, DT)
    steps = [model.predict(observation, pose, np.zeros(0)) for model in (right, printed)]
    np.testing.assert_allclose(steps[0].pose, steps[1].pose)
    expected = slopes(lambda p: right.predict(observation, p, np.zeros(0)).pose, pose)
    np.testing.assert_allclose(steps[0].by_pose, expected, atol=1e-8)
    wrong = expected.copy()
    wrong[1, 2] *= -1  # eq. (6), row 2, column 3
    np.testing.assert_allclose(steps[1].by_pose, wrong, atol=1e-8)


def test_odometry_is_corrected_by_its_constant_errors() -> None:
    predictor, observation = OdometryPredictor(Odometry()), {"odometry": np.array([0.8, 0.1, 0.05])}
    errors = np.array([-0.04, 0.06])
    found = predictor.predict(observation, errors)
    np.testing.assert_allclose(
        found.by_biases,
        slopes(lambda e: predictor.predict(observation, e).pose, errors),
        atol=1e-9,
    )
    assert found.pose[2] == pytest.approx(0.05 + 0.06 * np.hypot(0.8, 0.1))


@pytest.mark.parametrize(
    ("key", "predictor"),
    [
        ("steering", AckermannPredictor(STEERING, DT)),
        ("odometry", OdometryPredictor(Odometry())),
    ],
)
def test_what_is_not_reported_is_a_guess(
    key: str, predictor: AckermannPredictor | OdometryPredictor
) -> None:
    size = 2 if key == "steering" else 3
    none = np.zeros(len(predictor.errors))
    known = predictor.predict({key: np.full(size, 0.3)}, none)
    guess = predictor.predict({key: np.full(size, np.nan)}, none)
    assert known.measured and not guess.measured
    np.testing.assert_allclose(known.pose, guess.pose)
    assert (np.diag(guess.covariance) >= np.diag(known.covariance)).all()
    with pytest.raises(ValueError, match=f"observation '{key}' must be"):
        predictor.predict({key: np.full(size, np.inf)}, none)


READABLE = frozenset({"stamp", "lines", "steering", "tracks", "odometry"})


@pytest.mark.parametrize(
    ("rig", "options", "words"),
    [
        (Rig(dt=0.1), {"name": None}, "one of rig.steering, rig.tracks, rig.odometry"),
        (Rig(dt=0.1), {"name": "tracks"}, r"needs rig.tracks, and this rig has \[\]"),
        (Rig(dt=0.1, odometry=Odometry()), {"name": "trcks"}, "did you mean 'tracks'"),
        (
            Rig(dt=0.1, odometry=Odometry()),
            {"name": "one-point-ransac"},
            r"not shown \['left', 'right'\]; vo-line-slam",
        ),
        (
            Rig(dt=0.1, odometry=Odometry()),
            {"name": None, "paper": True},
            "paper=True is of a vehicle that steers",
        ),
    ],
)
def test_no_motion_is_refused_in_words(rig: Rig, options: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        motion_source(rig, readable=READABLE, **options)  # type: ignore[arg-type]
