"""How each algorithm learns to drive: its settings, made for minutes on two processors."""

from collections.abc import Callable, Mapping
from typing import Any, Final

from stable_baselines3.common.vec_env import VecEnv

from grouser.agents.learned import algorithm_class
from grouser.agents.learning.extractor import Features

_RATE: Final = 5e-4
_SMALLEST_RATE: Final = 2e-5
_DISCOUNT: Final = 0.985
"""A horizon of 7 s, 3 m of way: progress tells of what is farther."""
_SPREAD: Final = -0.3
"""Logarithm of the first sigma of actions; with less, too little is tried."""
_ENTROPY: Final = "auto_0.01"
"""SAC's weight of randomness at first, which it tunes. Rewards are some 0.02 a step: with its usual
weight of 1 they count for nothing for ten thousand updates, and no goal is ever reached."""


class FallingRate:
    """A learning rate that falls with the share of all steps that are done.

    Stable-Baselines3's own share is that of one call of `learn`; training here is many calls.
    """

    def __init__(self) -> None:
        self.done = 0.0
        """0 to 1"""

    def __call__(self, remaining: float) -> float:
        """Whatever it is told."""
        return _SMALLEST_RATE + (1 - self.done) * (_RATE - _SMALLEST_RATE)


def _ppo(rate: FallingRate) -> dict[str, Any]:
    layers = {"pi": [64, 64], "vf": [128, 128]}
    return {
        "policy": "MultiInputPolicy",
        "learning_rate": rate,
        "n_steps": 128,
        "batch_size": 512,
        "n_epochs": 8,
        "gamma": _DISCOUNT,
        "gae_lambda": 0.95,
        "policy_kwargs": _network(net_arch=layers, log_std_init=_SPREAD),
    }


def _recurrent_ppo(rate: FallingRate) -> dict[str, Any]:
    return {
        **_ppo(rate),
        "policy": "MultiInputLstmPolicy",
        "n_epochs": 4,
        "policy_kwargs": _network(
            net_arch={"pi": [64], "vf": [64]}, log_std_init=_SPREAD, lstm_hidden_size=64
        ),
    }


def _sac(rate: FallingRate) -> dict[str, Any]:
    return {
        "policy": "MultiInputPolicy",
        "learning_rate": rate,
        "buffer_size": 200_000,
        "learning_starts": 5_000,
        "batch_size": 256,
        "train_freq": 4,
        "gradient_steps": 32,
        "ent_coef": _ENTROPY,
        "gamma": _DISCOUNT,
        "policy_kwargs": _network(net_arch={"pi": [64, 64], "qf": [128, 128]}),
    }


def _network(**layers: Any) -> dict[str, Any]:
    return {"features_extractor_class": Features, **layers}


_SETTINGS: Final[Mapping[str, Callable[[FallingRate], dict[str, Any]]]] = {
    "ppo": _ppo,
    "sac": _sac,
    "recurrent-ppo": _recurrent_ppo,
}


def new_model(algorithm: str, env: VecEnv, rate: FallingRate, *, seed: int, log: str | None) -> Any:
    """A model that has learnt nothing yet.

    Args:
        algorithm: of `grouser.agents.learned.ALGORITHMS`.
        log: folder for TensorBoard, None for no log.

    Raises:
        ValueError: there is no such algorithm.
        ImportError: what it needs is not installed.
    """
    kind = algorithm_class(algorithm)
    settings = _SETTINGS[algorithm](rate)
    return kind(env=env, seed=seed, device="cpu", tensorboard_log=log, **settings)
