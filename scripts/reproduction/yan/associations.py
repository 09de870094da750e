"""Whether a filter took what it saw for what it was: its associations beside the truth."""

from collections.abc import Mapping

import numpy as np

from grouser.estimators.base import PoseEstimator
from grouser.estimators.line_slam.estimator import EkfLineSlam
from grouser.estimators.line_slam.lines import lines_to_world
from grouser.geometry import Array
from grouser.scripts.reproduction.yan.maps import nearest_lines


class Associations:
    """Looks on while filters drive, and counts by the truth in the end."""

    def __init__(self, estimators: Mapping[str, PoseEstimator]) -> None:
        self._filters = {
            name: estimator
            for name, estimator in estimators.items()
            if isinstance(estimator, EkfLineSlam)
        }
        self._noted: dict[str, list[tuple[Array, Array]]] = {name: [] for name in self._filters}

    def note(self) -> None:
        """A step is done, and every filter has seen it."""
        for name, estimator in self._filters.items():
            self._noted[name].append(estimator.matches)

    def counts(self, name: str, true: Array, poses: Array) -> tuple[int, int]:
        """How many lines that were seen corrected a filter's map, and how many of them were another
        line than that which they were taken for.

        Args:
            true: (n, 2) lines that there are, in the frame of the map.
            poses: (steps, 3) where the robot truly was after each step, in the same.
        """
        taken = seen = np.zeros(0, dtype=np.intp)
        for (of_map, from_robot), pose in zip(self._noted[name], poses, strict=True):
            if len(of_map):
                taken = np.append(taken, nearest_lines(of_map, true)[0])
                seen = np.append(seen, nearest_lines(lines_to_world(from_robot, pose), true)[0])
        return len(seen), int((taken != seen).sum())

    def __contains__(self, name: str) -> bool:
        """Whether it is a filter of lines."""
        return name in self._filters
