"""The tracked robot in a world: stand, drive, save, restore."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grouser.envs.simulation.bullet_dynamics import BulletDynamics
from grouser.envs.simulation.dynamics import PHYSICS_DT, Dynamics, PhysicalState
from grouser.envs.simulation.fast_dynamics import FastDynamics
from grouser.envs.simulation.materials import MATERIALS, Material
from grouser.envs.simulation.motion import Motion, motion_from_history
from grouser.envs.simulation.robot_model import RobotModel
from grouser.envs.simulation.standing import standing_body
from grouser.envs.simulation.track_law import Law
from grouser.envs.simulation.world import World
from grouser.geometry import Array

__all__ = ["DYNAMICS", "PHYSICS_DT", "RobotModel", "TrackedRobot"]

_LEAVES: dict[str, type[BulletDynamics] | type[FastDynamics]] = {
    "bullet": BulletDynamics,
    "fast": FastDynamics,
}

DYNAMICS = tuple(_LEAVES)
"""What may move the robot: Bullet, or a rigid body of our own that is some ten times faster."""

_SETTLING_STEPS = 120
_STOPPED = np.zeros(2)


class TrackedRobot:
    """The robot with its tracks and motors in a world of its own.

    Args:
        model: its body and tracks.
        dt: length of a control step, s: a multiple of PHYSICS_DT.
        dynamics: what moves it, of DYNAMICS.
        materials: what the world's grounds are made of, in the order of MATERIALS.

    Raises:
        ValueError: dt is no multiple of the physics step, or there are no such dynamics; the
            message says what there is.
    """

    def __init__(
        self,
        model: RobotModel,
        *,
        dt: float,
        dynamics: str = "bullet",
        materials: Sequence[Material] = MATERIALS,
    ) -> None:
        self.model = model
        self._n_substeps = _substeps(dt)
        self._law = Law.of(model)
        self._materials = tuple(materials)
        self._world: World | None = None
        self._dynamics = _make(dynamics, model, self._materials)

    def enter(self, world: World) -> Motion:
        """Stand at the start of a world, settled on its ground; what a sensor feels there."""
        self._load(world)
        body = standing_body(world, self.model, self._law, self._materials)
        self._state = PhysicalState.at_rest(body, self._law)
        self._run(_STOPPED, np.ones(2), _SETTLING_STEPS)
        return self._run(_STOPPED, np.ones(2), self._n_substeps)

    def step(
        self, commanded_speed: ArrayLike, power: ArrayLike = (1, 1), traction: ArrayLike = (1, 1)
    ) -> Motion:
        """Drive one control step.

        Args:
            commanded_speed: (2,) of the left and right track, m/s.
            power: (2,) share of that speed which each motor still gives.
            traction: (2,) share of the force along each track which its belt still passes on.
        """
        given = np.asarray(commanded_speed, dtype=np.float64) * np.asarray(power, dtype=np.float64)
        return self._run(given, np.array(traction, dtype=np.float64), self._n_substeps)

    def save(self) -> Any:
        """Everything that changes as the robot drives, picklable; the world is not in it."""
        return self._state.copy()

    def restore(self, saved: Any, world: World) -> None:
        """Go on from what `save` gave, in the world where it was saved: the same bits follow."""
        if world is not self._world:
            self._load(world)
        self._state = saved.copy()

    def close(self) -> None:
        """Free the physics."""
        self._dynamics.close()

    def _load(self, world: World) -> None:
        self._dynamics.load(world)
        self._world = world

    def _run(self, commanded_speed: Array, traction: Array, n: int) -> Motion:
        history, travel = np.empty((n + 1, 13)), np.zeros(2)
        contacts, collision = self._dynamics.advance(
            self._state, commanded_speed, traction, history, travel
        )
        return motion_from_history(
            history, travel, com_height=self.model.com_height, contacts=contacts,
            collision=collision,
        )  # fmt: skip


def _make(dynamics: str, model: RobotModel, materials: tuple[Material, ...]) -> Dynamics:
    if dynamics not in _LEAVES:
        raise ValueError(f"no dynamics are named {dynamics!r}; known: {', '.join(DYNAMICS)}")
    return _LEAVES[dynamics](model, materials)


def _substeps(dt: float) -> int:
    n = round(dt / PHYSICS_DT)
    if n < 1 or abs(n * PHYSICS_DT - dt) > 1e-9:
        raise ValueError(
            f"a control step of {dt} s is no multiple of the physics step of 1/240 s; "
            f"the nearest that is: {max(n, 1) / 240:.6g} s"
        )
    return n
