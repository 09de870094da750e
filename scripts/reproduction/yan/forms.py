"""The filter's forms, and what they are compared with."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from grouser.estimators import registry
from grouser.estimators.base import PoseEstimator
from grouser.rig import Rig
from grouser.scripts.reproduction.yan.steering_reckoning import SteeringReckoning

LINE_SLAM = "ekf-line-slam"
RECKONING = "steering alone"


@dataclass(frozen=True, slots=True)
class Form:
    """An estimator with its options; but for them, its defaults."""

    words: str
    options: Mapping[str, Any] = field(default_factory=dict)
    estimator: str = LINE_SLAM
    sees: str | None = "lines"
    """Key of the observation, or nothing."""


CORRECTED = "corrected"
PRINTED = "printed"

FORMS: dict[str, Form] = {
    CORRECTED: Form("lines by (r, alpha), corrected"),
    PRINTED: Form("the same, (6) and (7) as printed", {"paper": True}),
    "first-estimates": Form("first-estimates Jacobians", {"jacobians": "first-estimates"}),
    "right-invariant": Form("right-invariant", {"jacobians": "right-invariant"}),
}
"""Those whose honesty is looked into."""

RIVALS: dict[str, Form] = {
    "reckoning": Form("steering alone", estimator=RECKONING, sees=None),
    "scan": Form("lines in a scan of 360 beams", sees="lidar"),
}


def make_form(form: Form, rig: Rig, **more: Any) -> PoseEstimator:
    """A new estimator of that form."""
    if form.estimator == RECKONING:
        return SteeringReckoning(rig)
    return registry.make(form.estimator, rig, **form.options, **more)
