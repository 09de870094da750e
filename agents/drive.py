"""The loop: a driver drives the goal task, step by step, to the end of an episode."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from grouser.agents.driver import Driver
from grouser.estimators.base import PoseEstimate, Status

if TYPE_CHECKING:  # the task itself drives, to rehearse
    from grouser.agents.navigation import GoalNavEnv


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """What came of an action."""

    action: Any
    info: Mapping[str, Any]
    believed: PoseEstimate
    """The last estimate that has arrived."""

    @property
    def error(self) -> float:
        """Between believed and true position, m."""
        return math.dist(self.believed.pose[:2], self.info["true_pose"][:2])

    @property
    def is_lost(self) -> bool:
        """Whether the robot knows that it does not know where it is."""
        return self.believed.status is Status.LOST


def steps(env: "GoalNavEnv", driver: Driver, seed: int) -> Iterator[Step]:
    """The steps of an episode, the last of which ends it."""
    shown, _ = env.reset(seed=seed)
    driver.reset(env.rig, env.world)
    ended = False
    while not ended:
        action = driver.action(shown, env.believed, env.goal)
        shown, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
        yield Step(action, info, env.believed)
