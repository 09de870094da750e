"""Paper 2's planar worlds as a source of observations, driven through their course."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import count
from typing import Any

import gymnasium as gym

import grouser  # noqa: F401  (registers the environments)
from grouser.envs.plane.world import make_plane_world
from grouser.estimators.base import TRUTH_KEYS
from grouser.estimators.evaluation.comparison import OpenLoop
from grouser.geometry import Array
from grouser.scripts.compare_source import Env
from grouser.scripts.compare_tour import tour

_LONG = 100_000
"""Steps; every world's course is shorter."""


@dataclass(frozen=True, slots=True)
class Plane:
    """grouser/LineWorld-v0 with steering, in one of its worlds, seen by ends of lines or a scan."""

    name: str
    lidar: bool = False
    """Whether it looks with a lidar instead of the line sensor."""
    drivable: bool = True
    reference_sigmas: None = None

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
        """Those asked for, as far as the course goes on so long."""
        drive = self.drive(_LONG if asked is None else asked)
        return next(step for step in count() if drive(step) is None)

    def drive(self, steps: int) -> OpenLoop:
        """The actions of an operator who sees where the vehicle is, until its course ends.

        They are the same for every seed, for noise does not move the vehicle.
        """
        return tour(self.make(()), 0, steps)

    @property
    def segments(self) -> Array:
        """(n, 4) both ends of what stands there, in the frame of the start, m."""
        return make_plane_world(self.name).segments_from_start
