"""Learned drivers: a policy of Stable-Baselines3 in one file, with the task that it was made for.

The file is the zip that Stable-Baselines3 writes, with a member `grouser.json` besides: the name of
the algorithm, and the keyword arguments of GoalNav that shape what the policy sees and does. Where
the policy is a plain network, a member `layers.npz` holds its matrices, and it drives by them:
neither Stable-Baselines3 nor PyTorch is needed then, nor need the rest be there.
"""

import importlib
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from grouser.agents.driver import Action, Driver
from grouser.agents.learning.mlp import MlpPolicy, plain_policy
from grouser.checks import did_you_mean
from grouser.envs.simulation.world import World
from grouser.estimators.base import PoseEstimate
from grouser.geometry import Array
from grouser.rig import Rig

ALGORITHMS: Final[Mapping[str, str]] = {
    "ppo": "stable_baselines3:PPO",
    "sac": "stable_baselines3:SAC",
    "recurrent-ppo": "sb3_contrib:RecurrentPPO",
}
"""Where each algorithm's class is found, by the name that `grouser train` calls it."""

TASK_OPTIONS: Final = ("policy_sensors", "beams", "normalize", "covariance", "stop")
"""Arguments of GoalNav without which a policy could not read its observations."""

_MEMBER, _LAYERS = "grouser.json", "layers.npz"


class LearnedDriver(Driver):
    """Does what a trained policy does. A plain network's actions are drawn as in training, from a
    generator that begins anew with every episode; other policies do what they hold best.

    It sees the task's observation alone; of the map it knows nothing.
    """

    def __init__(self, path: str | Path) -> None:
        """
        Args:
            path: a file that `save_policy` wrote.

        Raises:
            FileNotFoundError: there is none.
            ValueError: it is no such file.
            ImportError: the policy needs Stable-Baselines3, and that is not installed.
        """
        told, self._plain = _read_members(Path(path))
        self.task: Mapping[str, Any] = told["task"]
        if self._plain is None:
            self._model = algorithm_class(told["algorithm"]).load(path, device="cpu")

    def reset(self, rig: Rig, world: World) -> None:
        """A new episode: a recurrent policy forgets the last one."""
        self._rng = np.random.default_rng(0)
        self._memory: Any = None
        self._is_first = np.ones(1, dtype=bool)

    def action(
        self, observation: Mapping[str, NDArray[Any]], believed: PoseEstimate, goal: Array
    ) -> Action:
        """The policy's action: drawn, or the most likely one or the mean."""
        if self._plain is not None:
            return self._plain(observation, self._rng)
        action, self._memory = self._model.predict(
            observation, state=self._memory, episode_start=self._is_first, deterministic=True
        )
        self._is_first = np.zeros(1, dtype=bool)
        return np.asarray(action, dtype=np.float32)


def save_policy(model: Any, path: str | Path, *, algorithm: str, task: Mapping[str, Any]) -> None:
    """Write a policy that `LearnedDriver` reads.

    Args:
        model: of Stable-Baselines3.
        path: the file; what is there is replaced.
        algorithm: of ALGORITHMS.
        task: keyword arguments of `GoalNavEnv`, of TASK_OPTIONS; those that are left out stand at
            their defaults.

    Raises:
        ValueError: an unknown algorithm, or an option that is not one of the view.
    """
    algorithm_spec(algorithm)
    wrong = sorted(set(task) - set(TASK_OPTIONS))
    if wrong:
        raise ValueError(f"{wrong[0]!r} shapes no view of a policy; {', '.join(TASK_OPTIONS)} do")
    with Path(path).open("wb") as file:
        model.save(file)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(_MEMBER, json.dumps({"algorithm": algorithm, "task": dict(task)}))
        plain = plain_policy(model, algorithm)
        if plain is not None:
            archive.writestr(_LAYERS, plain.to_bytes())


def save_plain(policy: str | Path, path: str | Path) -> None:
    """Write what a policy's file needs to drive without Stable-Baselines3, and no more.

    Args:
        policy: a file that `save_policy` wrote.
        path: the new file; what is there is replaced.

    Raises:
        FileNotFoundError: there is no policy.
        ValueError: it is no plain network.
    """
    told, plain = _read_members(Path(policy))
    if plain is None:
        raise ValueError(f"{policy} is no plain network: it cannot do without Stable-Baselines3")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(_MEMBER, json.dumps(told))
        archive.writestr(_LAYERS, plain.to_bytes())


def algorithm_spec(name: str) -> str:
    """Where the class of an algorithm is found.

    Raises:
        ValueError: there is none of that name.
    """
    if name not in ALGORITHMS:
        hint = did_you_mean(name, ALGORITHMS)
        raise ValueError(f"no algorithm is named {name!r}; {hint}known: {', '.join(ALGORITHMS)}")
    return ALGORITHMS[name]


def algorithm_class(name: str) -> Any:
    """The class of an algorithm.

    Raises:
        ValueError: there is none of that name.
        ImportError: the package that has it is not installed.
    """
    module, _, kind = algorithm_spec(name).partition(":")
    try:
        return getattr(importlib.import_module(module), kind)
    except ImportError as error:
        raise ImportError(f"{name} needs {module} ({error}): pip install 'grouser[rl]'") from error


def _read_members(path: Path) -> tuple[dict[str, Any], MlpPolicy | None]:
    if not path.is_file():
        raise FileNotFoundError(f"there is no policy at {path}")
    try:
        with zipfile.ZipFile(path) as archive:
            told: dict[str, Any] = json.loads(archive.read(_MEMBER))
            has_layers = _LAYERS in archive.namelist()
            plain = MlpPolicy.from_bytes(archive.read(_LAYERS)) if has_layers else None
    except (zipfile.BadZipFile, KeyError) as error:
        raise ValueError(
            f"{path} is no policy of Grouser's ({error}); `grouser train` and "
            "`grouser.agents.learned.save_policy` write one"
        ) from error
    return told, plain
