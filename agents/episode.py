"""One episode of the goal task under a driver and an estimator, and what is kept of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from grouser.agents.drive import Step, steps
from grouser.agents.driver import Driver
from grouser.agents.drivers import make_driver
from grouser.agents.estimation import estimation
from grouser.agents.goal_score import COLLISION, SUCCESS
from grouser.agents.navigation import GoalNavEnv


@dataclass(frozen=True, slots=True)
class Trial:
    """An episode that is to be run: all that decides every bit of it. Picklable."""

    policy: str
    """A driver's name, or the file of a learned one."""
    estimator: str
    seed: int
    task: Mapping[str, Any] = field(default_factory=dict)
    """Further arguments of `GoalNavEnv`; the driver's own come first."""

    @property
    def pose_latency(self) -> float:
        """How late estimates arrive, s."""
        return float(self.task.get("pose_latency", 0.0))


@dataclass(frozen=True, slots=True)
class Episode:
    """What is kept of an episode."""

    policy: str
    estimator: str
    seed: int
    outcome: str
    """"success", "missed", "collision" or "timeout"."""
    success: bool
    spl: float
    """Success weighted by path length: the shortest way over the driven one, 0 without success."""
    soft_spl: float
    """The same with the share of the way that was gained instead of success."""
    collision: bool
    time_s: float
    path_length_m: float
    shortest_path_m: float
    goals_reached: int
    distance_to_goal_m: float
    """At the end, truly."""
    believed_distance_to_goal_m: float
    """At the end, as the robot believed."""
    position_error_m: float
    """Root mean square over the steps of the distance between believed and true position."""
    lost: float
    """Share of the steps whose estimate was LOST."""
    pose_latency: float = 0.0
    """How late estimates arrived, s."""


def run_trial(trial: Trial) -> Episode:
    """Drive it to its end.

    Raises:
        ValueError: there is no such driver or estimator, or the task does not go with them.
        ImportError: the driver needs a package that is not installed.
    """
    driver = make_driver(trial.policy)
    env = goal_task(driver, trial.estimator, trial.task)
    try:
        return _keep(trial, env, list(steps(env, driver, trial.seed)))
    finally:
        env.close()


def goal_task(
    driver: Driver, estimator: str, task: Mapping[str, Any], **options: Any
) -> GoalNavEnv:
    """The environment that shows what a driver reads, with the pose of an estimator or of an
    emulator (`estimation`)."""
    return GoalNavEnv(**{**driver.task, **task, **options, **estimation(estimator)})


def _keep(trial: Trial, env: GoalNavEnv, driven: list[Step]) -> Episode:
    last = driven[-1].info
    shortest, length = float(last["shortest_path"]), float(last["path_length"])
    directness = shortest / max(shortest, length)
    success = last["outcome"] == SUCCESS
    return Episode(
        policy=trial.policy,
        estimator=trial.estimator,
        seed=trial.seed,
        outcome=last["outcome"],
        success=success,
        spl=directness if success else 0.0,
        soft_spl=max(0.0, float(last["progress"])) * directness,
        collision=last["outcome"] == COLLISION,
        time_s=len(driven) * env.rig.dt,
        path_length_m=length,
        shortest_path_m=shortest,
        goals_reached=int(last["goals_reached"]),
        distance_to_goal_m=float(last["distance_to_goal"]),
        believed_distance_to_goal_m=float(last["believed_distance_to_goal"]),
        position_error_m=float(np.sqrt(np.mean([step.error**2 for step in driven]))),
        lost=float(np.mean([step.is_lost for step in driven])),
        pose_latency=trial.pose_latency,
    )
