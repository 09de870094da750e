"""What a policy is trained on: GoalNav on the light stack, under an estimator's emulated errors."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import gymnasium as gym

from grouser.agents.estimation import emulated, estimation
from grouser.agents.navigation import GoalNavEnv
from grouser.envs.fleet.crew import Maker
from grouser.estimators.emulation.model_file import load_model
from grouser.estimators.registry import GROUND_TRUTH

_TIME_LIMIT = 60.0
"""s for a goal; one that takes longer teaches little, but for a long time."""
_REWARD = {"progress": 0.5, "success": 2.0, "missed": -0.5, "collision": -2.5, "step": -0.003}
"""Returns near one are learnt best; progress tells most, so that it counts for more than in the
task's own reward."""
_CROWDED, _TOUCHING = 0.65, 0.3
"""m from the lidar to what is nearest: below the first it costs, at the second _COST a step. The
robot's sides are 0.24 m from it and its corners 0.38 m."""
_COST = 0.03


class _KeepClear(gym.Wrapper[Any, Any, Any, Any]):
    """Nearness costs, long before a collision does: what is to be avoided is learnt in minutes."""

    def __init__(self, env: gym.Env[Any, Any], *, unit: float) -> None:
        super().__init__(env)
        self._unit = unit

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        nearest = self._unit * float(observation["beams"].min())
        crowded = min(max((_CROWDED - nearest) / (_CROWDED - _TOUCHING), 0.0), 1.0)
        return observation, float(reward) - _COST * crowded, terminated, truncated, info


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
    covariance: bool | str = False
    """Whether the policy sees the estimate's covariance, or "shuffled", those of other moments."""

    def __post_init__(self) -> None:
        if self.estimator != GROUND_TRUTH:
            load_model(self.estimator)

    def make(self, world: str) -> gym.Env[Any, Any]:
        """GoalNav in a world, with the robot's body moved by the fast dynamics."""
        env = GoalNavEnv(
            **self._estimation,
            **self.view,
            world=world,
            goals=self.goals,
            time_limit=_TIME_LIMIT,
            reward=_REWARD,
            robot={"dynamics": "fast", "difficulty": self.difficulty},
        )
        assert env.rig.lidar is not None
        return _KeepClear(env, unit=env.rig.lidar.range_max)

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
        truth = self.estimator == GROUND_TRUTH
        return estimation(GROUND_TRUTH if truth else emulated(self.estimator))
