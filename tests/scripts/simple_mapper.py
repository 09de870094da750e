"""The simplest that makes a map of lines: dead reckoning, and lines where they are seen first."""

from typing import Any, ClassVar

import numpy as np

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, Status
from grouser.estimators.line_slam.lines import line_through, lines_to_world, places_along
from grouser.estimators.line_slam.map import LineMap, LineMapper
from grouser.estimators.line_slam.map_file import line_map_of
from grouser.geometry import wrap
from grouser.rig import Rig

NEAR_M, NEAR_RAD = 3.0, 0.3


class SimpleMapper(PoseEstimator, LineMapper):
    requires: ClassVar[frozenset[str]] = frozenset({"stamp"})
    optional: ClassVar[frozenset[str]] = frozenset({"steering", "lines", "lidar"})

    def __init__(self, rig: Rig, *, map: Any = None) -> None:
        self._rig, self._given = rig, None if map is None else line_map_of(map)

    @property
    def map(self) -> LineMap:
        n = len(self._lines)
        if self._given is not None:
            return self._given
        extents = np.array(self._extents).reshape(n, 2)
        sigmas = np.tile([0.2, 0.01], n)
        counts, ends = np.ones(n), np.zeros((n, 2), dtype=bool)
        lines = np.array(self._lines).reshape(n, 2)
        return LineMap(lines, np.diag(sigmas**2), extents, ends, counts)  # type: ignore[arg-type]

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        self._pose = np.zeros(3)
        self._lines: list[Any] = []
        self._extents: list[Any] = []
        return self.update({**observation, "steering": np.zeros(2)})

    def update(self, observation: Observation) -> PoseEstimate:
        if "steering" in observation and self._rig.steering is not None:
            V, a = observation["steering"]
            way, heading = self._rig.dt * V, self._pose[2]
            turn = way * np.sin(a) / self._rig.steering.wheelbase
            self._pose += [way * np.cos(heading + a), way * np.sin(heading + a), turn]
        for row in observation.get("lines", np.zeros((0, 4))):
            if row.any():
                self._see(row.reshape(2, 2))
        pose = np.append(self._pose[:2], wrap(self._pose[2]))
        return PoseEstimate(pose, np.eye(3), Status.COASTING, float(observation["stamp"][0]))

    def _see(self, ends: Any) -> None:
        at = ends[:, :1] * np.stack([np.cos(ends[:, 1]), np.sin(ends[:, 1])], axis=1)
        seen = line_through(at[0], at[1])
        line = lines_to_world(seen, self._pose)
        for known in self._lines:
            if abs(wrap(line[1] - known[1])) < NEAR_RAD and abs(line[0] - known[0]) < NEAR_M:
                return
        across = self._pose[:2] @ [-np.sin(line[1]), np.cos(line[1])]
        self._lines.append(line)
        self._extents.append(np.sort(places_along(seen, at) + across))
