"""What a policy is trained on: GoalNav on the light stack, under an estimator's emulated errors."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import gymnasium as gym

from grouser.agents.navigation import GoalNavEnv
from grouser.envs.fleet.crew import Maker
from grouser.estimators.emulation.model_file import load_model
from grouser.estimators.registry import GROUND_TRUTH

_TIME_LIMIT = 60.0
"""s for a goal; one that takes longer teaches little, but for a long time."""
_REWARD = {"progress": 0.1, "success": 1.0, "missed": -0.5, "collision": -1.5, "step": -0.001}
"""The task's own a tenth, for returns near one, which networks learn best; but a collision costs
more, or a policy cuts corners and hopes."""


@dataclass(frozen=True, slots=True)
class TrainingTask:
    """A task that a policy learns; evaluation asks for the same view.

    Raises:
        ValueError: no emulator of the estimator is known.
    """

    estimator: str = "ekf-line-slam"
    """Whose errors the policy learns under: ground-truth, an estimator that has an emulator, or the
    JSON file of one."""
    worlds: tuple[str, ...] = ("depot",)
    """Environments take turns with them."""
    difficulty: float = 0.5
    """Of the worlds, 0 to 1."""
    goals: int = 1
    """An episode's."""
    covariance: bool = False
    """Whether the policy sees the estimate's covariance."""

    def __post_init__(self) -> None:
        if self.estimator != GROUND_TRUTH:
            load_model(self.estimator)

    def make(self, world: str) -> gym.Env[Any, Any]:
        """GoalNav in a world, with the robot's body moved by the fast dynamics."""
        return GoalNavEnv(
            **self._estimation,
            **self.view,
            world=world,
            goals=self.goals,
            time_limit=_TIME_LIMIT,
            reward=_REWARD,
            robot={"dynamics": "fast", "difficulty": self.difficulty},
        )

    def makers(self, n: int) -> list[Maker]:
        """Of so many environments."""
        return [partial(self.make, self.worlds[k % len(self.worlds)]) for k in range(n)]

    @property
    def view(self) -> Mapping[str, Any]:
        """Arguments of GoalNav that shape observations and actions, of `learned.TASK_OPTIONS`."""
        return {"covariance": self.covariance}

    @property
    def settings(self) -> dict[str, Any]:
        """All of it, for a folder of results."""
        return asdict(self)

    @property
    def _estimation(self) -> dict[str, Any]:
        if self.estimator == GROUND_TRUTH:
            return {"estimator": GROUND_TRUTH}
        return {"estimator": "emulated", "estimator_options": {"of": self.estimator}}
