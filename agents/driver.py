"""Who drives the goal task: one interface for planners, reactive drivers and learned policies."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.world import World
from grouser.estimators.base import PoseEstimate
from grouser.geometry import Array
from grouser.rig import Rig

Action = NDArray[np.float32]


class Driver(ABC):
    """Drives a robot to goals by what the robot may know. A driver never sees `info`, for the truth
    is in there."""

    task: Mapping[str, Any]
    """Keyword arguments of `GoalNavEnv` that make its observations and actions what this driver
    reads and gives: policy_sensors, beams, normalize, covariance, stop."""

    @abstractmethod
    def reset(self, rig: Rig, world: World) -> None:
        """A new episode.

        Args:
            rig: the robot's calibration.
            world: as the robot's operator knows it, who also put the robot at its start. Planners
                read it; whoever goes without a map leaves it alone.
        """

    @abstractmethod
    def action(
        self, observation: Mapping[str, NDArray[Any]], believed: PoseEstimate, goal: Array
    ) -> Action:
        """What the robot is to do now, an action of the task.

        Args:
            observation: what the task shows.
            believed: the last estimate that arrived.
            goal: (2,) m, in the frame of the start, as estimates are.
        """
