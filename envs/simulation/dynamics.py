"""What moves the robot: one interface, and all that changes while it moves."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from grouser.envs.simulation.track_law import Law
from grouser.envs.simulation.world import World
from grouser.geometry import Array

PHYSICS_DT = 1 / 240
"""Length of a physics step, s."""

LOOK_EVERY = 24
"""Physics steps between two looks at what is within `Law.reach`."""


@dataclass(frozen=True, slots=True, eq=False)
class PhysicalState:
    """Everything of a robot that changes from one control step to the next. Written in place."""

    body: Array
    """(13,) laid out as `track_law.ground_wrench` says."""
    track_speed: Array
    """(2,) m/s"""
    shear: Array
    """(m, 2) m, of the ground under each point that touches it."""

    @staticmethod
    def at_rest(body: Array, law: Law) -> "PhysicalState":
        """A robot that was just put down."""
        return PhysicalState(body.copy(), np.zeros(2), np.zeros((len(law.points), 2)))

    def copy(self) -> "PhysicalState":
        """The same in memory of its own."""
        return PhysicalState(self.body.copy(), self.track_speed.copy(), self.shear.copy())


class Dynamics(ABC):
    """Moves a robot in a world. It remembers the world alone: the rest is in the PhysicalState."""

    @abstractmethod
    def load(self, world: World) -> None:
        """Forget the last world and take this one."""

    @abstractmethod
    def advance(
        self, state: PhysicalState, commanded_speed: Array, traction: Array, history: Array,
        travel: Array,
    ) -> tuple[int, bool]:  # fmt: skip
        """Move by as many physics steps as history has room for.

        Args:
            state: in and out.
            commanded_speed: (2,) that the motors follow, m/s.
            traction: (2,) share of the force along each track that its belt passes on.
            history: out, (n + 1, 13) the body before the first and after every physics step.
            travel: in and out, (2,) how far the tracks ran, m.

        Returns:
            The points that touch an obstacle at the end, and whether any did at any time.
        """

    def close(self) -> None:  # noqa: B027 - not all hold something
        """Free what it holds; a second call does nothing."""
