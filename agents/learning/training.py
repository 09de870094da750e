"""Training that a kill cannot spoil: by chapters, each of which begins from what is on disk.

A chapter begins with new episodes and with generators seeded by its number. What a training does
from there on depends on nothing else, so that one that was killed and resumed ends with the same
policy, bit for bit, as one that was not.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import torch
from stable_baselines3.common.callbacks import BaseCallback

from grouser.agents.learned import save_policy
from grouser.agents.learning.algorithms import FallingRate, new_model
from grouser.agents.learning.checkpoint import Checkpoint
from grouser.agents.learning.sb3_vector import Sb3Vector
from grouser.agents.learning.task import TrainingTask

N_ENVS: Final = 16
CHAPTER: Final = 24 * 2048
"""Steps; whole rollouts of 128 of 16 environments."""

_FIRST_SEED: Final = 10**9
"""Far from the seeds that policies are evaluated with."""

OnSteps = Callable[[int, float | None], None]
"""Called with the steps that are done, and the share of the last episodes that reached the goal."""


@dataclass(frozen=True, slots=True)
class Training:
    """A training as it is asked for."""

    task: TrainingTask
    algorithm: str
    steps: int
    """At least so many are taken: whole rollouts."""
    seed: int
    folder: Path
    """Holds checkpoint, TensorBoard's log and, at the end, policy.zip."""
    n_envs: int = N_ENVS
    chapter: int = CHAPTER
    """Steps between two checkpoints."""

    @property
    def policy(self) -> Path:
        """The file that will hold the policy."""
        return self.folder / "policy.zip"


def train(training: Training, on_steps: OnSteps) -> None:
    """Train from the folder's checkpoint, or from nothing, to the end; then write the policy."""
    torch.set_num_threads(1)  # its matrices are small, and the environments want the processors
    env = Sb3Vector(training.task.makers(training.n_envs))
    rate, checkpoint = FallingRate(), Checkpoint(training.folder, training.algorithm)
    try:
        if checkpoint.exists():
            model = checkpoint.load(env, rate)
        else:
            model = new_model(
                training.algorithm, env, rate, seed=training.seed, log=str(training.folder)
            )
        while model.num_timesteps < training.steps:
            _chapter(model, rate, training, on_steps)
            checkpoint.save(model)
    finally:
        env.close()
    save_policy(model, training.policy, algorithm=training.algorithm, task=training.task.view)


def _chapter(model: Any, rate: FallingRate, training: Training, on_steps: OnSteps) -> None:
    begun = model.num_timesteps
    model.set_random_seed((_FIRST_SEED + training.seed * 1_000_003 + begun) % 2**32)
    model._last_obs = None  # so that `learn` resets the environments
    left = min(training.chapter, training.steps - begun)
    following = _Following(rate, training.steps, on_steps)
    model.learn(left, callback=following, reset_num_timesteps=False, tb_log_name="log")


class _Following(BaseCallback):
    """Tells the rate and whoever watches how far a training is."""

    def __init__(self, rate: FallingRate, steps: int, on_steps: OnSteps) -> None:
        super().__init__()
        self._rate, self._steps, self._on_steps = rate, steps, on_steps

    def _on_rollout_start(self) -> None:
        self._rate.done = min(self.num_timesteps / self._steps, 1.0)

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        ended = self.model.ep_success_buffer
        self._on_steps(self.num_timesteps, sum(ended) / len(ended) if ended else None)
