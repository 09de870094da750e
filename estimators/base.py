"""The contract of every pose estimator: a stream of observations in, honest poses out."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array

Observation: TypeAlias = Mapping[str, NDArray[Any]]
"""What one step of an environment shows: keys, shapes and units as in docs of the environments."""


class Status(Enum):
    """How an estimate came about."""

    TRACKING = "tracking"
    """A measurement of the outside world supports it."""
    COASTING = "coasting"
    """Prediction only: the covariance grows until a measurement returns."""
    LOST = "lost"
    """Predicted for too long; the pose should not be acted upon."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseEstimate:
    """A pose in the frame of the first observation, with how far it may be off."""

    pose: Array
    """(3,) x [m], y [m], heading [rad] wrapped to (-pi, pi]."""
    covariance: Array
    """(3, 3) of x, y, heading; honest: the NEES is near 3."""
    status: Status
    stamp: float
    """s"""
    pose_3d: Array | None = None
    """(4, 4) T_start_base, from estimators that know height, roll and pitch."""
    diagnostics: Mapping[str, float] = field(default_factory=dict)
    """Matches, inliers, iterations, milliseconds per stage."""


class PoseEstimator(ABC):
    """Turns a stream of observations into poses in the frame of the first one.

    A leaf class is constructed as `Estimator(rig, **options)`, raises `ValueError` there when the
    rig lacks a part that it needs, and is deterministic: the same generator and observations give
    the same bits. It keeps no reference to an observation.
    """

    requires: ClassVar[frozenset[str]]
    """Observation keys that it reads; it is given these and no others."""
    optional: ClassVar[frozenset[str]] = frozenset()
    """Observation keys that it reads where the robot has them."""
    optional_for_source: ClassVar[frozenset[str]] = frozenset()
    """Those of them that it reads only for another estimator, which its option `source` names."""
    requires_one_of: ClassVar[tuple[frozenset[str], ...]] = ()
    """Groups of the optional keys, of each of which it needs one at least."""

    @abstractmethod
    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start anew at pose zero with the first observation."""

    @abstractmethod
    def update(self, observation: Observation) -> PoseEstimate:
        """Take the next observation and return the pose at its stamp."""


OBSERVATION_KEYS = frozenset(
    {
        *("left", "right", "tracks", "lidar", "imu", "gps"),
        *("steering", "odometry", "lines", "points", "stamp"),
    }
)
"""Keys that an environment may show; which of them it does depends on its robot."""

TRUTH_KEYS = frozenset({"true_pose", "true_pose_3d"})
"""Keys of `info` that only ground-truth and emulated may require (`registry.TRUTH_READERS`)."""


SAME_TIME = 1e-6
"""s: stamps closer than this are the same time, for they are sums of steps."""


def stamp_of(key: str, observation: Observation) -> float:
    """s; when that was measured, which is now where nothing else is said."""
    return float(observation.get(f"{key}_stamp", observation["stamp"])[0])


def lacking(kind: type[PoseEstimator], given: Iterable[str]) -> list[str]:
    """What a kind of estimator would need beside the keys `given`; of a group, "a or b"."""
    given = frozenset(given)
    groups = [group for group in kind.requires_one_of if not group & given]
    return [*sorted(kind.requires - given), *(" or ".join(sorted(group)) for group in groups)]


def check_observation_keys(estimator: PoseEstimator, given: Iterable[str]) -> None:
    """Check that an environment shows what an estimator requires.

    Raises:
        ValueError: it does not; the message names both sets.
    """
    _check_keys(type(estimator), given)


def _check_keys(kind: type[PoseEstimator], given: Iterable[str]) -> None:
    given = set(given)
    missing = lacking(kind, given | TRUTH_KEYS)
    if missing:
        one_of = "".join(f" and one of {sorted(group)}" for group in kind.requires_one_of)
        raise ValueError(
            f"{kind.__name__} requires observations {sorted(kind.requires)}{one_of}, but "
            f"the environment gives {sorted(given)}, without {missing}; make the environment with "
            "sensors= that include them, or choose another estimator"
        )


def readable(
    estimator: PoseEstimator, observation: Observation, info: Mapping[str, Any]
) -> dict[str, NDArray[Any]]:
    """The part of an observation that an estimator may see: what it declares, and nothing else.

    Of what it may see, it is also told when that was measured: `<key>_stamp`, where there is one.

    The truth is handed over only to an estimator that requires it by name, which the registry
    allows for ground-truth and emulated alone.

    Raises:
        ValueError: the environment does not give what the estimator requires.
    """
    # Of the class, which the registry has checked: an instance cannot ask for more.
    seen, truth = _readable_keys(type(estimator), frozenset(observation))
    untold = [key for key in truth if key not in info]
    if untold:
        raise ValueError(
            f"{type(estimator).__name__} requires {untold} in info, which gives {sorted(info)}; "
            "a recording without its reference poses has no truth to tell"
        )
    return {key: observation[key] for key in seen} | {key: info[key] for key in truth}


@cache
def _readable_keys(
    kind: type[PoseEstimator], given: frozenset[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Of an observation's keys those that a kind of estimator may see, and of the truth's those
    that it is told; they are the same at every step."""
    _check_keys(kind, given)
    truth = kind.requires & TRUTH_KEYS
    seen = (kind.requires - truth) | (kind.optional & given)
    seen |= {f"{key}_stamp" for key in seen} & given
    return tuple(sorted(seen)), tuple(sorted(truth))
