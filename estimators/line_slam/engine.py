"""Line SLAM behind its estimators: what sees the lines, the filter, and what it tells."""

from functools import partial
from pathlib import Path

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate
from grouser.estimators.line_slam.ekf import LineEkf, LineEkfOptions, Told
from grouser.estimators.line_slam.linearization import make_linearization
from grouser.estimators.line_slam.map import LineMap
from grouser.estimators.line_slam.map_file import load_line_map
from grouser.estimators.line_slam.motion_source import MakeMotion
from grouser.estimators.line_slam.sight import make_sight
from grouser.estimators.line_slam.state import LineState
from grouser.estimators.line_slam.support import Support
from grouser.estimators.line_slam.unevenness import Unevenness
from grouser.geometry import Array
from grouser.kernels import announce
from grouser.rig import Rig


class LineSlam:
    """Takes observations, one after another, as the estimators that are made of it do."""

    def __init__(
        self,
        rig: Rig,
        make_motion: MakeMotion,
        *,
        jacobians: str,
        map: str | Path | LineMap | None,
        start_sigma: tuple[float, float, float],
        options: LineEkfOptions,
        unevenness: float | None,
        supported_for: float,
    ) -> None:
        """
        Raises:
            ValueError: an option out of range, or a rig that sees no lines.
        """
        if rig.line_sensor is None and rig.lidar is None:
            raise ValueError(
                "line SLAM needs rig.line_sensor or rig.lidar to see lines, and this rig has "
                "neither; make the environment with the sensor 'lines' or 'lidar'"
            )
        announce()
        self._rig, self._jacobians, self._make_motion = rig, jacobians, make_motion
        make_linearization(jacobians)  # raises, if there is none of that name
        self._supported_for = supported_for
        self._map = load_line_map(map) if isinstance(map, str | Path) else map
        self._start_sigma = _sigmas(start_sigma)
        self._options, self._uneven = options, unevenness
        self._filter: LineEkf | None = None
        self._told = Told(measured=False)

    @property
    def filter(self) -> LineEkf:
        """The filter at work.

        Raises:
            RuntimeError: `reset` was not called yet.
        """
        if self._filter is None:
            raise RuntimeError("call reset() with the first observation first")
        return self._filter

    @property
    def map(self) -> LineMap:
        """The lines as they are known now, or the map that was given, as it was given."""
        running = self.filter
        return running.known() if self._map is None else self._map

    @property
    def matches(self) -> tuple[Array, Array]:
        """(k, 2) lines of the map that corrected the estimate last, and (k, 2) each as it was seen
        from the robot."""
        _ = self.filter  # raises before the first one
        none = (np.zeros((0, 2)), np.zeros((0, 2)))
        of_map, seen = zip(none, *self._told.pairs, strict=True)
        return np.concatenate(of_map), np.concatenate(seen)

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
        self._filter = LineEkf(
            state,
            motion,
            make_linearization(self._jacobians),
            self._unevenness(tilts=motion.slips),
            self._options,
        )
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
        told = self.filter.step(observation, partial(self._sight.lines, observation))
        return self._estimate(observation, told)

    def _unevenness(self, *, tilts: bool) -> Unevenness:
        """A robot that tilts on what its tracks climb sees even walls elsewhere, bit by bit."""
        known = self._uneven if self._sight.of_surfaces else 0.0
        return Unevenness(known, least=_LEAST_WHERE_IT_TILTS if tilts else 0.0)

    def _estimate(self, observation: Observation, told: Told) -> PoseEstimate:
        state, self._told = self.filter.state, told
        return self._support.estimate(
            observation,
            state.pose,
            state.pose_covariance,
            supported=told.matched + told.new > 0,
            diagnostics={
                "lines_in_map": float(len(state)),
                "lines_seen": float(told.seen),
                "lines_matched": float(told.matched),
                "lines_new": float(told.new),
                "nis": told.nis,
                "unevenness": self.filter.unevenness.sigma,
            },
        )


_LEAST_WHERE_IT_TILTS = 0.01  # m


def _sigmas(given: tuple[float, float, float]) -> Array:
    sigmas = np.array(given, dtype=np.float64)
    if sigmas.shape != (3,) or not (np.isfinite(sigmas) & (sigmas >= 0)).all():
        raise ValueError(
            f"start_sigma must be x, y [m] and heading [rad], each zero or more, got {given}"
        )
    return sigmas
