"""A course through a world, and the actions that drive it without striking anything."""

from dataclasses import dataclass, field

import numpy as np

from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.geometry import Array
from grouser.scripts.reproduction.zhao.manoeuvres import Manoeuvre

_TRIES = 50  # seeds


@dataclass(frozen=True, slots=True)
class Course:
    """What is driven where."""

    name: str
    world: str
    manoeuvre: Manoeuvre
    frames: int
    """Updates of the estimators."""
    first_seed: int = 0
    """The first from here on whose world lets the course be driven is taken."""
    difficulty: float = 0.5
    terrain: str | None = None
    effects: tuple[tuple[str, float], ...] = field(default_factory=tuple)

    def make(self, sensors: tuple[str, ...]) -> TrackedRobotEnv:
        """The environment, with these sensors."""
        return TrackedRobotEnv(
            world=self.world,
            difficulty=self.difficulty,
            terrain=self.terrain,
            effects=dict(self.effects),
            sensors=sensors,
        )


@dataclass(frozen=True, slots=True)
class Planned:
    """A course whose world was chosen and whose actions are known."""

    seed: int
    actions: Array
    """(frames, 2)"""


def plan(course: Course) -> Planned:
    """Drive the course without sensors, in one world after another until nothing is struck.

    Sensors change nothing of where the robot goes: with them, the same actions do the same.

    Raises:
        RuntimeError: the robot strikes something in every world that was tried.
    """
    env = course.make(())
    try:
        for seed in range(course.first_seed, course.first_seed + _TRIES):
            actions = _driven(env, course, seed)
            if actions is not None:
                return Planned(seed, actions)
    finally:
        env.close()
    raise RuntimeError(
        f"course {course.name!r} strikes something in each of {_TRIES} worlds {course.world!r}; "
        "make it shorter, or choose another world"
    )


def _driven(env: TrackedRobotEnv, course: Course, seed: int) -> Array | None:
    """(frames, 2) the actions; None where the robot strikes something."""
    _, info = env.reset(seed=seed)
    operator = course.manoeuvre.operator(env, info, course.frames)
    actions = np.empty((course.frames, 2))
    for step in range(course.frames):
        actions[step] = operator(step, info)
        *_, info = env.step(actions[step].astype(np.float32))
        if info["collision"]:
            return None
    return actions
