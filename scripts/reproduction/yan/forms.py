"""The filter's forms, and what they are compared with."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from grouser.envs.plane.plane_rig import NOISES
from grouser.envs.plane.world import make_plane_world
from grouser.estimators import registry
from grouser.estimators.base import PoseEstimator
from grouser.rig import Rig
from grouser.scripts.reproduction.yan.steering_reckoning import SteeringReckoning

LINE_SLAM, POINT_SLAM = "ekf-line-slam", "ekf-point-slam"
RECKONING = "steering alone"


@dataclass(frozen=True, slots=True)
class Form:
    """An estimator with its options; but for them, its defaults."""

    words: str
    options: Mapping[str, Any] = field(default_factory=dict)
    estimator: str = LINE_SLAM
    sees: str | None = "lines"
    """Key of the observation, or nothing."""
    noise: tuple[tuple[str, float], ...] = ()
    """Of the environment's, other ones by name."""


CORRECTED = "corrected"
PRINTED = "printed"

FORMS: dict[str, Form] = {
    CORRECTED: Form("lines by (r, alpha), corrected"),
    PRINTED: Form("the same, (6) and (7) as printed", {"paper": True}),
    "first-estimates": Form("first-estimates Jacobians", {"jacobians": "first-estimates"}),
    "right-invariant": Form("right-invariant", {"jacobians": "right-invariant"}),
}
"""Those whose honesty is looked into."""

POINTS = "points"
POINTS_PRINTED_11 = "points-printed-11"
ESTIMATED_FEET = "estimated-feet"


def _points(words: str, **options: Any) -> Form:
    return Form(words, options, POINT_SLAM, "points")


def _feet(words: str) -> Form:
    """Feet of the world's origin, which is not where the drive starts."""
    x, y = make_plane_world("yan-normal").from_start([[0.0, 0.0]])[0].tolist()
    return Form(words, {"landmarks": "estimated-feet", "origin": (x, y)}, POINT_SLAM)


_BEAMS = (("scan_range", NOISES["range"]), ("scan_bearing", NOISES["bearing"]))
"""A beam as noisy as an end that is seen."""

RIVALS: dict[str, Form] = {
    "reckoning": Form("steering alone", estimator=RECKONING, sees=None),
    "scan": Form("lines in a scan of 360 beams, the paper's noises", sees="lidar", noise=_BEAMS),
    "scan-lidar": Form("the same, 0.03 m and 0.1 degrees", sees="lidar"),
    POINTS: _points("foot points that a sensor reports, (10) and (11) corrected"),
    "points-printed-motion": _points("the same, (6) and (7) as printed", paper=True),
    POINTS_PRINTED_11: _points("the same, (11) as printed", paper_observation=True),
    "points-printed": _points("all as printed", paper=True, paper_observation=True),
    ESTIMATED_FEET: _feet("foot points by the estimated pose, as section 1.3 has it"),
}
"""What they are compared with, in the normal run."""


def make_form(form: Form, rig: Rig, **more: Any) -> PoseEstimator:
    """A new estimator of that form."""
    if form.estimator == RECKONING:
        return SteeringReckoning(rig)
    return registry.make(form.estimator, rig, **form.options, **more)
