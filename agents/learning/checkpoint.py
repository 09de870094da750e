"""A training as it is on disk between two chapters: all of it, or that of the chapter before."""

import os
from pathlib import Path
from typing import Any

from stable_baselines3.common.vec_env import VecEnv

from grouser.agents.learned import algorithm_class
from grouser.agents.learning.algorithms import FallingRate


class Checkpoint:
    """The files of a training's folder that it is resumed from.

    Args:
        folder: made where it does not exist.
        algorithm: of `grouser.agents.learned.ALGORITHMS`.
    """

    def __init__(self, folder: Path, algorithm: str) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._model = folder / "checkpoint.zip"
        self._algorithm = algorithm

    def exists(self) -> bool:
        """Whether there is anything to resume."""
        return self._model.exists()

    def save(self, model: Any) -> None:
        """Write the model and what it remembers; a kill leaves the last ones or these."""
        if self._remembers:
            model.save_replay_buffer(self._replay(model.num_timesteps))
        partial = self._model.with_suffix(".partial")
        with partial.open("wb") as file:
            model.save(file)
        os.replace(partial, self._model)
        for other in self._model.parent.glob("replay-*.pkl"):
            if other != self._replay(model.num_timesteps):
                other.unlink()

    def load(self, env: VecEnv, rate: FallingRate) -> Any:
        """The model that was saved, to go on with in an environment."""
        rates = {"learning_rate": rate, "lr_schedule": rate}
        kind = algorithm_class(self._algorithm)
        model = kind.load(self._model, env=env, device="cpu", custom_objects=rates)
        if self._remembers:
            model.load_replay_buffer(self._replay(model.num_timesteps))
        return model

    @property
    def _remembers(self) -> bool:
        return self._algorithm == "sac"

    def _replay(self, steps: int) -> Path:
        """The replay buffer that goes with a model: its name says which, so that a kill between
        the two files does no harm."""
        return self._model.with_name(f"replay-{steps}.pkl")
