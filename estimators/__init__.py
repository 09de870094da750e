"""Pose estimators by name, and the wrapper that puts one into an environment."""

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, Status
from grouser.estimators.registry import make, names, register
from grouser.estimators.wrapper import EstimatedPose

register("ground-truth", "grouser.estimators.ground_truth:GroundTruth")
register("dead-reckoning", "grouser.estimators.dead_reckoning:DeadReckoning")
register(
    "one-point-ransac", "grouser.estimators.visual.odometry:VisualOdometry", solver="one-point"
)
register(
    "five-point-ransac", "grouser.estimators.visual.odometry:VisualOdometry", solver="five-point"
)

__all__ = [
    "EstimatedPose",
    "Observation",
    "PoseEstimate",
    "PoseEstimator",
    "Status",
    "make",
    "names",
    "register",
]
