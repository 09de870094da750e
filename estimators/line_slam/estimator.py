"""`ekf-line-slam`: paper 2's filter as a pose estimator, with its options."""

from pathlib import Path
from typing import ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator
from grouser.estimators.line_slam.association import AssociationOptions
from grouser.estimators.line_slam.ekf import LineEkf, LineEkfOptions, Told
from grouser.estimators.line_slam.linearization import make_linearization
from grouser.estimators.line_slam.map import LineMap, LineMapper
from grouser.estimators.line_slam.map_file import load_line_map
from grouser.estimators.line_slam.motion_source import motion_source
from grouser.estimators.line_slam.sight import make_sight
from grouser.estimators.line_slam.state import LineState
from grouser.estimators.line_slam.support import Support
from grouser.geometry import Array
from grouser.kernels import announce
from grouser.rig import Rig


class EkfLineSlam(PoseEstimator, LineMapper):
    """EKF SLAM with lines as landmarks (SPEC 2.2), in the frame of the start.

    Lines come from the observation `lines` or, without it, from `lidar`; the motion from
    `steering`, `tracks` or `odometry`, or from another estimator's increments. A scan none of
    whose lines is one of the map's is bridged by the motion (COASTING).
    """

    requires: ClassVar[frozenset[str]] = frozenset({"stamp"})
    optional: ClassVar[frozenset[str]] = frozenset(
        {"lines", "lidar", "tracks", "steering", "odometry"}
    )
    requires_one_of: ClassVar[tuple[frozenset[str], ...]] = (frozenset({"lines", "lidar"}),)

    def __init__(
        self,
        rig: Rig,
        *,
        odometry: str | None = None,
        paper: bool = False,
        jacobians: str = "standard",
        map: str | Path | LineMap | None = None,
        start_sigma: tuple[float, float, float] = (0.0, 0.0, 0.0),
        gate: float = 9.21,
        new_above: float = 25.0,
        supported_for: float = 0.5,
    ) -> None:
        """
        Args:
            rig: the calibration; `line_sensor` or `lidar`, and of what measures the motion.
            odometry: what predicts: "steering", "tracks", "odometry", or the name of an estimator
                whose increments do. None takes the first of these three that the rig has.
            paper: the motion's Jacobians (6) and (7) as printed, with two wrong signs.
            jacobians: "standard", "first-estimates" or "right-invariant": where the filter
                linearises, which decides how sure it becomes of its heading.
            map: a map that was saved by `save_line_map`, or its path, in the frame of this start:
                the way is found by it, and no line is added.
            start_sigma: how well the start is known in the frame of `map`: x, y [m], heading
                [rad], one sigma.
            gate: squared innovation over its covariance up to which a line is one of the map's.
            new_above: the same to the nearest, above which a line is new.
            supported_for: s that a look at lines supports the estimate.

        Raises:
            ValueError: an option out of range, or a rig that sees no lines or knows no motion.
        """
        if rig.line_sensor is None and rig.lidar is None:
            raise ValueError(
                "line SLAM needs rig.line_sensor or rig.lidar to see lines, and this rig has "
                "neither; make the environment with the sensor 'lines' or 'lidar'"
            )
        announce()
        self._rig, self._jacobians = rig, jacobians
        self._make_motion = motion_source(
            rig, odometry, readable=self.requires | self.optional, paper=paper
        )
        make_linearization(jacobians)  # raises, if there is none of that name
        self._supported_for = supported_for
        self._map = load_line_map(map) if isinstance(map, str | Path) else map
        self._start_sigma = _sigmas(start_sigma)
        self._options = LineEkfOptions(
            AssociationOptions(gate=gate, new_above=new_above), learns=self._map is None
        )
        self._filter: LineEkf | None = None

    @property
    def map(self) -> LineMap:
        known = self._running().known()
        return known if self._map is None else self._map

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        """Start at pose zero: known exactly, or in the frame of a map as `start_sigma` says.

        Raises:
            ValueError: the observation shows neither lines nor a scan.
        """
        self._sight = make_sight(self._rig, observation)
        self._support = Support(self._supported_for)
        motion = self._make_motion(observation, rng)
        state = LineState(np.zeros(3), motion.errors.sigmas)
        state.buffer[:3, :3] = np.diag(self._start_sigma**2)
        self._filter = LineEkf(state, motion, make_linearization(self._jacobians), self._options)
        if self._map is not None:
            self._filter.know(self._map)
        told = self._filter.start(self._sight.lines(observation))
        # The start is pose zero by definition; what is seen there tells of the lines.
        return self._estimate(observation, told)

    def update(self, observation: Observation) -> PoseEstimate:
        """Take the next observation.

        Raises:
            RuntimeError: `reset` was not called yet.
            ValueError: lines or motion that are not what the contract says.
        """
        told = self._running().step(observation, self._sight.lines(observation))
        return self._estimate(observation, told)

    def _running(self) -> LineEkf:
        if self._filter is None:
            raise RuntimeError("call reset() with the first observation first")
        return self._filter

    def _estimate(self, observation: Observation, told: Told) -> PoseEstimate:
        state, stamp = self._running().state, float(observation["stamp"][0])
        covariance = state.pose_covariance
        return PoseEstimate(
            pose=state.pose.copy(),
            covariance=covariance,
            status=self._support.status(told, stamp, covariance),
            stamp=stamp,
            diagnostics={
                "lines_in_map": float(len(state)),
                "lines_seen": float(told.seen),
                "lines_matched": float(told.matched),
                "lines_new": float(told.new),
                "nis": told.nis,
            },
        )


def _sigmas(given: tuple[float, float, float]) -> Array:
    sigmas = np.array(given, dtype=np.float64)
    if sigmas.shape != (3,) or not (np.isfinite(sigmas) & (sigmas >= 0)).all():
        raise ValueError(
            f"start_sigma must be x, y [m] and heading [rad], each zero or more, got {given}"
        )
    return sigmas
