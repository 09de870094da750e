"""Another estimator as a sensor: how the robot moved since an anchor, and how sure it is."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from grouser.estimators.base import (
    TRUTH_KEYS,
    Observation,
    PoseEstimate,
    Status,
    check_observation_keys,
)
from grouser.estimators.registry import estimator_class, make
from grouser.geometry import Array, between, compose_jacobians
from grouser.rig import Rig

_FLOOR = np.diag([1e-4, 1e-4, 5e-5]) ** 2  # m, m, rad: nothing is surer of a motion than this


class PoseSource:
    """An estimator that is not shown the tracks, so that what it says is independent of them."""

    def __init__(self, name: str, rig: Rig, options: Mapping[str, Any]) -> None:
        """
        Raises:
            ValueError: an unknown name, or an estimator that needs the tracks or the truth.
        """
        kind = estimator_class(name)
        needs = kind.requires.union(*kind.requires_one_of)
        if refused := sorted(needs & (TRUTH_KEYS | {"tracks"})):
            raise ValueError(
                f"{name!r} cannot be the source, because it reads {refused}; a source sees where "
                "the robot goes without its tracks, as 'one-point-ransac' does"
            )
        self._estimator = make(name, rig.with_overrides({"tracks": None}), **options)
        self.eyes = tuple(sorted(kind.requires & {"left", "right"}))
        """The images that it sees."""

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> None:
        """Start anew, with the first observation as anchor.

        Raises:
            ValueError: the observation lacks what the source requires.
        """
        check_observation_keys(self._estimator, observation)
        self._anchor = self._now = self._estimator.reset(self._seen(observation), rng=rng)
        self._missed = False

    def update(self, observation: Observation) -> bool:
        """Take the next observation; whether the motion since the anchor is known."""
        if any(eye not in observation for eye in self.eyes):
            self._missed = True
            return False
        self._now = self._estimator.update(self._seen(observation))
        known = self._anchor.status is self._now.status is Status.TRACKING and not self._missed
        self._missed = False
        if not known:
            self._anchor = self._now  # nothing is known of the motion across a gap
        return known

    def anchor(self) -> None:
        """The last observation becomes the anchor."""
        self._anchor = self._now

    def relative(self) -> tuple[Array, Array]:
        """(3,) the pose as seen from the anchor, and its covariance (3, 3)."""
        pose = between(self._anchor.pose, self._now.pose)
        return pose, relative_covariance(self._anchor, self._now, pose)

    def _seen(self, observation: Observation) -> Observation:
        return {key: value for key, value in observation.items() if key != "tracks"}


def relative_covariance(before: PoseEstimate, after: PoseEstimate, pose: Array) -> Array:
    """(3, 3) of the motion (3,) between two estimates: what it added to their covariance.

    P_after = F P_before F' + G R G' where the motion's error is independent of the pose's. Where it
    is not, R may come out too small, or negative; less than a floor is not believed.
    """
    F, G = compose_jacobians(before.pose, pose)
    added = after.covariance - F @ before.covariance @ F.T
    R = np.linalg.solve(G, np.linalg.solve(G, added).T)
    values, vectors = np.linalg.eigh((R + R.T) / 2)
    return np.asarray((vectors * np.maximum(values, 0)) @ vectors.T + _FLOOR)
