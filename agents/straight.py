"""The simplest driver: straight at the goal as the robot believes it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.agents.driver import Action, Driver
from grouser.agents.waypoints import action_toward
from grouser.envs.simulation.world import World
from grouser.estimators.base import PoseEstimate
from grouser.geometry import Array
from grouser.rig import Rig


class Straight(Driver):
    """Turns towards the goal and drives to it, whatever stands in between: what any other driver
    should beat where there are obstacles. A robot that is LOST stands still."""

    task: Mapping[str, Any] = {"policy_sensors": ()}

    def reset(self, rig: Rig, world: World) -> None:
        """A new episode; the world is not looked at."""
        self._rig = rig

    def action(
        self, observation: Mapping[str, NDArray[Any]], believed: PoseEstimate, goal: Array
    ) -> Action:
        """Towards the goal, or at rest."""
        return action_toward(believed, goal, self._rig).astype(np.float32)
