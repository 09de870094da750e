"""Paper 2's planar worlds as a source of observations, driven through their course."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

import grouser  # noqa: F401  (registers the environments)
from grouser.agents.steering import SteeringDriver
from grouser.envs.plane.world import make_plane_world
from grouser.estimators.base import TRUTH_KEYS, PoseEstimate, Status
from grouser.geometry import Array
from grouser.scripts.compare_source import Env


@dataclass(frozen=True, slots=True)
class Plane:
    """grouser/LineWorld-v0 with steering, in one of its worlds, seen by ends of lines or a scan."""

    name: str
    lidar: bool = False
    """Whether it looks with a lidar instead of the line sensor."""
    drivable: bool = True

    @property
    def label(self) -> str:
        return f"world:{self.name}"

    @property
    def settings(self) -> dict[str, Any]:
        return {"world": self.name, "lidar": self.lidar}

    def gives(self) -> frozenset[str]:
        sight = "lidar" if self.lidar else "lines"
        return frozenset({"steering", sight, "stamp"}) | TRUTH_KEYS

    def make(self, sensors: Iterable[str]) -> Env:
        return gym.make("grouser/LineWorld-v0", world=self.name, sensors=tuple(sensors))

    def steps(self, asked: int | None) -> int:
        course = len(self.actions())
        return course if asked is None else min(asked, course)

    def actions(self) -> list[Array]:
        """Those of an operator who sees where the vehicle is, to the end of the world's course.

        They are the same for every seed, for noise does not move the vehicle.
        """
        scout = self.make(())
        driver = SteeringDriver(
            scout.get_wrapper_attr("rig"), scout.get_wrapper_attr("world").course
        )
        _, info = scout.reset(seed=0)
        actions: list[Array] = []
        while True:
            seen = PoseEstimate(info["true_pose"], np.zeros((3, 3)), Status.TRACKING, 0.0)
            action = driver(seen)
            if action is None:
                return actions
            actions.append(action)
            *_, info = scout.step(action.astype(np.float32))

    @property
    def segments(self) -> Array:
        """(n, 4) both ends of what stands there, in the frame of the start, m."""
        return make_plane_world(self.name).segments_from_start
