"""The lines of the filter, and all that is kept of each: they come, become one and go together."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.end_points import EndPoints
from grouser.estimators.line_slam.linearization import Linearization
from grouser.estimators.line_slam.lines import lines_to_world, points_on
from grouser.estimators.line_slam.map import LineMap
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.sightings import Sightings
from grouser.estimators.line_slam.state import POSE, LineState
from grouser.geometry import Array, rotate


class Landmarks:
    """Of each line its states, where it is linearised, its ends, and how often it was seen."""

    def __init__(self, state: LineState, linearization: Linearization, patience: int) -> None:
        """
        Args:
            state: without lines.
            patience: scans after which a line that was seen once is forgotten.
        """
        self.state, self.linearization = state, linearization
        self.end_points, self.sightings = EndPoints(), Sightings(patience)

    def know(self, line_map: LineMap) -> None:
        """Take the lines of a map with their joint covariance, before anything is seen."""
        state = self.state
        at = state.size
        for line, extent, open_ends, count in zip(
            line_map.lines, line_map.extents, line_map.open_ends, line_map.counts, strict=True
        ):
            self._add(line, (), np.zeros((2, 0)), np.zeros((2, 2)))
            self.end_points.add(line, points_on(line, extent), np.zeros(2), open_ends)
            self.sightings.add(int(count))
        state.buffer[at : state.size, at : state.size] = line_map.covariance

    def known(self) -> LineMap:
        """The lines as they are known now."""
        return LineMap(
            lines=self.state.lines,
            covariance=self.state.covariance(range(self.state.head, self.state.size)),
            extents=self.end_points.extents,
            open_ends=self.end_points.open_ends,
            counts=self.sightings.counts,
        )

    def insert(self, seen: LineMeasurements) -> None:
        """New lines: a = a_l + heading, r = r_l + x cos a + y sin a."""
        state = self.state
        for i, line in enumerate(lines_to_world(seen.lines, state.pose)):
            n, lever = np.array([np.cos(line[1]), np.sin(line[1])]), _lever(line, state.pose)
            Gv = np.array([[n[0], n[1], lever], [0.0, 0.0, 1.0]])
            Gz = np.array([[1.0, lever], [0.0, 1.0]])
            self._add(line, range(POSE), Gv, Gz @ seen.covariances[i] @ Gz.T)
            ends = _in_world(seen.ends[i], state.pose)
            self.end_points.add(line, ends, seen.end_sigmas[i], seen.open_ends[i])
            self.sightings.add()

    def extend(self, which: NDArray[np.intp], seen: LineMeasurements) -> None:
        """The k lines at `which` were seen again, as those of `seen`, and may reach farther."""
        ends = _in_world(seen.ends, self.state.pose)
        self.end_points.extend(which, self.state.lines, ends, seen.end_sigmas, seen.open_ends)

    def join(self, kept: int, gone: int) -> None:
        """Two lines are one."""
        self.end_points.join(kept, gone, self.state.lines)
        self.sightings.join(kept, gone)
        self.state.forget(gone)
        self.linearization.forgot(gone)

    def forget_doubtful(self) -> None:
        """Lines that nobody saw again are none."""
        for line in self.sightings.doubtful().tolist():
            self.state.forget(line)
            self.linearization.forgot(line)
            self.end_points.forget(line)
            self.sightings.forget(line)

    def _add(self, line: Array, indices: Sequence[int], G: Array, noise: Array) -> None:
        self.state.add(line, indices, G, noise)
        self.linearization.added(self.state)


def _in_world(points: Array, pose: Array) -> Array:
    """(..., 2) points in the frame of a pose (3,), in its parent."""
    return np.asarray(pose[:2] + rotate(pose[2], points))


def _lever(line: Array, pose: Array) -> float:
    """Derivative of r by the heading, and by alpha as it was seen: -x sin a + y cos a."""
    return float(-pose[0] * np.sin(line[1]) + pose[1] * np.cos(line[1]))
