"""What measures the motion of a robot among lines: chosen by name, or as the rig has it."""

from collections.abc import Callable
from functools import partial

import numpy as np

from grouser.checks import did_you_mean
from grouser.estimators import registry
from grouser.estimators.base import TRUTH_KEYS, Observation
from grouser.estimators.line_slam.ackermann import AckermannPredictor
from grouser.estimators.line_slam.motion import MotionModel, PredictedMotion, PrintedSteering
from grouser.estimators.line_slam.odometry_predictor import OdometryPredictor
from grouser.estimators.line_slam.scan_aided_predictor import ScanAidedPredictor
from grouser.estimators.line_slam.source_predictor import SourcePredictor
from grouser.estimators.visual.prediction import ScaleOptions, TrackPredictor
from grouser.rig import Rig

MakeMotion = Callable[[Observation, np.random.Generator], MotionModel]
"""A new motion model for an episode that begins with this observation."""

OWN = ("steering", "tracks", "odometry")
"""Parts of a rig that measure the motion, the one that counts first."""


def motion_source(
    rig: Rig,
    name: str | None,
    *,
    readable: frozenset[str],
    paper: bool = False,
    scan_aided: bool = False,
) -> MakeMotion:
    """What makes the motion model.

    Args:
        name: one of OWN, or an estimator whose increments are taken; None takes the first of OWN
            that the rig has.
        readable: keys that whoever asks reads, so that the estimator may read them, too.
        paper: the printed Jacobians of steering.
        scan_aided: each scan, where there are any, is laid over the last ones to correct what
            odometry reports. Not for whoever matches scans: each would count twice.

    Raises:
        ValueError: the rig lacks what is named, or has nothing at all; nothing has that name; or
            the estimator would read more.
    """
    if name is None:
        name = next((part for part in OWN if getattr(rig, part) is not None), None)
        if name is None:
            raise ValueError(
                f"line SLAM needs one of rig.{', rig.'.join(OWN)} to predict the motion, and this "
                "rig has none; give it one, or name an estimator as odometry="
            )
    if paper and name != "steering":
        raise ValueError(
            f'paper=True is of a vehicle that steers, odometry="steering"; here it is {name!r}'
        )
    if name in OWN:
        if getattr(rig, name) is None:
            has = [part for part in OWN if getattr(rig, part) is not None]
            raise ValueError(f"odometry={name!r} needs rig.{name}, and this rig has {has}")
        return partial(_own, rig, name, paper, scan_aided)
    if name not in registry.names():
        hint = did_you_mean(name, [*OWN, *registry.names()])
        raise ValueError(
            f"odometry must be one of {', '.join(OWN)}, or the name of an estimator, got {name!r}; "
            f"{hint}"
        )
    kind = registry.estimator_class(name)
    if kind.requires & TRUTH_KEYS or not kind.requires <= readable:
        raise ValueError(
            f"odometry={name!r} reads {sorted(kind.requires)}, of which this estimator is "
            f"not shown {sorted(kind.requires - readable)}; vo-line-slam is shown images"
        )
    registry.make(name, rig)  # raises, where the rig lacks what it needs
    return partial(_estimated, rig, name)


def _own(
    rig: Rig,
    name: str,
    paper: bool,
    scan_aided: bool,
    observation: Observation,
    rng: np.random.Generator,
) -> MotionModel:
    if name == "steering":
        assert rig.steering is not None
        if paper:
            return PrintedSteering(rig.steering, rig.dt)
        return PredictedMotion(AckermannPredictor(rig.steering, rig.dt))
    if name == "tracks":
        assert rig.tracks is not None
        return PredictedMotion(
            TrackPredictor(rig.tracks, ScaleOptions(transient_noise=0.0)),
            slips=True,
        )
    assert rig.odometry is not None
    odometry = OdometryPredictor(rig.odometry)
    if scan_aided and rig.lidar is not None and "lidar" in observation:
        return PredictedMotion(ScanAidedPredictor(odometry, rig, observation))
    return PredictedMotion(odometry)


def _estimated(
    rig: Rig, name: str, observation: Observation, rng: np.random.Generator
) -> MotionModel:
    return PredictedMotion(SourcePredictor(registry.make(name, rig), observation, rng))
