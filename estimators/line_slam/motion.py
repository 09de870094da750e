"""How the filter's pose moves: a predictor's increments, or the paper's equations as printed."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from grouser.estimators.base import Observation
from grouser.estimators.line_slam.ackermann import reported_steering, steered
from grouser.estimators.visual import single_pose
from grouser.estimators.visual.constant_errors import NO_ERRORS, ConstantErrors
from grouser.estimators.visual.prediction import MotionPredictor
from grouser.geometry import Array, between, compose
from grouser.rig_motion import Steering


@dataclass(frozen=True, slots=True)
class Step:
    """The pose after a step, and what it depends on."""

    pose: Array
    """(3,)"""
    by_pose: Array
    """(3, 3) derivative by the pose before it"""
    by_errors: Array
    """(3, n) derivative by the constant errors"""
    covariance: Array
    """(3, 3) of its white noise"""
    measured: bool = True
    """Whether anything measured it."""


class MotionModel(ABC):
    """Predicts the pose after a step."""

    errors: ConstantErrors
    """Its n constant errors, which the filter estimates."""
    slips: bool
    """Whether it may report a motion that did not take place, as tracks that slip do."""

    @abstractmethod
    def predict(self, observation: Observation, pose: Array, errors: Array) -> Step:
        """From a pose (3,), with the constant errors (n,) as estimated."""

    @abstractmethod
    def learn(self, before: Array, after: Array) -> None:
        """Take note of the poses (3,) that a step led from and to, as estimated in the end."""


class PredictedMotion(MotionModel):
    """By increments in the robot's frame, composed exactly."""

    def __init__(self, predictor: MotionPredictor, *, slips: bool = False) -> None:
        self._predictor, self.slips = predictor, slips
        self.errors = predictor.errors

    def predict(self, observation: Observation, pose: Array, errors: Array) -> Step:
        increment = self._predictor.predict(observation, errors)
        by_pose, by_increment = single_pose.compose_jacobians(pose, increment.pose)
        return Step(
            single_pose.compose(pose, increment.pose),
            by_pose,
            by_increment @ increment.by_biases,
            by_increment @ increment.covariance @ by_increment.T,
            increment.measured,
        )

    def learn(self, before: Array, after: Array) -> None:
        self._predictor.learn(between(before, after))


class PrintedSteering(MotionModel):
    """Eq. (5), with the Jacobians (6) and (7) as the paper prints them: two signs are wrong."""

    errors = NO_ERRORS
    slips = False

    def __init__(self, steering: Steering, dt: float) -> None:
        self._steering, self._dt = steering, dt

    def predict(self, observation: Observation, pose: Array, errors: Array) -> Step:
        control = reported_steering(observation)
        if control is None:
            raise ValueError(
                "the printed filter has no word for steering that is not reported (NaN); use the "
                "corrected one, paper=False"
            )
        speed, angle = control.tolist()
        T, L, heading = self._dt, self._steering.wheelbase, pose[2] + angle
        c, s = np.cos(heading), np.sin(heading)
        by_pose = np.eye(3)
        by_pose[:2, 2] = -T * speed * s, -T * speed * c  # eq. (6); right is + T V cos
        by_control = T * np.array(
            [
                [c, -speed * s],
                [-s, speed * c],  # eq. (7); right is + T sin
                [np.sin(angle) / L, speed * np.cos(angle) / L],
            ]
        )
        noise = np.diag([self._steering.sigma_speed**2, self._steering.sigma_angle**2])
        return Step(
            compose(pose, steered(control, L, T)),
            by_pose,
            np.zeros((3, 0)),
            by_control @ noise @ by_control.T,
        )

    def learn(self, before: Array, after: Array) -> None:
        """It expects nothing again."""
