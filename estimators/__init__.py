"""Pose estimators by name, and the wrapper that puts one into an environment."""

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, Status
from grouser.estimators.registry import make, names, register
from grouser.estimators.wrapper import EstimatedPose

register("ground-truth", "grouser.estimators.ground_truth:GroundTruth")
register("emulated", "grouser.estimators.emulation.estimator:Emulated")
register("dead-reckoning", "grouser.estimators.dead_reckoning:DeadReckoning")
register("icr-ekf", "grouser.estimators.icr_ekf:IcrEkf")
register("vo-imu-gps", "grouser.estimators.vo_imu_gps:VoImuGps")
for _name, _solver in {
    "one-point-ransac": "one-point",
    "histogram-voting": "histogram",
    "two-point-ransac": "two-point",
    "three-point-ransac": "three-point",
    "disparity-space": "disparity-space",
    "five-point-ransac": "five-point",
}.items():
    register(_name, "grouser.estimators.visual.odometry:VisualOdometry", solver=_solver)

register(
    "one-point-paper",
    "grouser.estimators.visual.odometry:VisualOdometry",
    solver="one-point",
    paper=True,
)
register("one-point-ekf", "grouser.estimators.monocular.estimator:MonocularEkf", sample=1)
register("two-point-ekf", "grouser.estimators.monocular.estimator:MonocularEkf", sample=2)
register("scan-matching", "grouser.estimators.scan_matching.estimator:ScanMatching")
register("ekf-line-slam", "grouser.estimators.line_slam.estimator:EkfLineSlam")
register("vo-line-slam", "grouser.estimators.line_slam.vo_estimator:VoLineSlam")
register("ekf-point-slam", "grouser.estimators.line_slam.point_estimator:EkfPointSlam")
register("graph-line-slam", "grouser.estimators.graph_slam.estimator:GraphLineSlam")

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
