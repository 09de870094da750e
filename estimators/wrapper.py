"""The Gymnasium wrapper that puts a pose estimator between a robot and whoever drives it."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from grouser.estimators import registry
from grouser.estimators.base import (
    Observation,
    PoseEstimate,
    PoseEstimator,
    check_observation_keys,
    readable,
)
from grouser.estimators.random_stream import estimator_seeds
from grouser.rig import Rig

# Bounds of the estimate in the observation space; finite, because Gymnasium's checker asks for it.
_FAR = 1e6  # m
_VARIANCE = 1e12  # m^2


class EstimatedPose(
    gym.Wrapper[dict[str, Any], Any, dict[str, Any], Any], gym.utils.RecordConstructorArgs
):
    """Adds an estimated pose to the observation.

    The observation gains `pose` (3,): x [m], y [m], heading [rad] in the frame of the start, and
    `pose_covariance` (3, 3), both float64. The info gains `pose_status`: "tracking", "coasting" or
    "lost". Height, diagnostics and timings of the last estimate are in `estimate`.

    The estimator sees the observation keys that it declares and nothing else; the truth in `info`
    is handed over to ground-truth and emulated alone. Its randomness comes from the seed of
    `reset`: the same seed gives the same bits, and the environment's own random stream is left
    untouched.

    Its arguments are recorded, so that `gym.make(env.spec)` rebuilds environment and estimator.
    """

    def __init__(self, env: gym.Env[dict[str, Any], Any], estimator: str, **options: Any) -> None:
        """
        Args:
            env: an environment with a `rig` and an observation space of type Dict.
            estimator: a registered name; see `grouser.estimators.names()`.
            options: keyword arguments of that estimator.

        Raises:
            ValueError: an unknown estimator, or an environment that lacks what it requires.
        """
        gym.utils.RecordConstructorArgs.__init__(self, estimator=estimator, **options)
        super().__init__(env)
        inner = _dict_space(env)
        self._estimator = registry.make(estimator, _rig(env), **options)
        check_observation_keys(self._estimator, inner.keys())
        self.observation_space = spaces.Dict({**inner.spaces, **_pose_spaces()})
        self._seeds: np.random.SeedSequence | None = None
        self._estimate: PoseEstimate | None = None

    @property
    def estimator(self) -> PoseEstimator:
        """The estimator at work; a SLAM estimator's `map` is found here."""
        return self._estimator

    @property
    def estimate(self) -> PoseEstimate:
        """The last estimate, with status, 3-D pose and diagnostics.

        Raises:
            gym.error.ResetNeeded: there is none before the first `reset`.
        """
        if self._estimate is None:
            raise gym.error.ResetNeeded("there is no estimate before the first env.reset()")
        return self._estimate

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Reset the environment, and the estimator on its first observation."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._estimate = self._estimator.reset(
            readable(self._estimator, observation, info), rng=self._next_generator(seed)
        )
        return _with_estimate(observation, info, self._estimate)

    def step(self, action: Any) -> tuple[dict[str, Any], Any, bool, bool, dict[str, Any]]:
        """Step the environment, and the estimator on what it shows."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._estimate = self._estimator.update(readable(self._estimator, observation, info))
        observation, info = _with_estimate(observation, info, self._estimate)
        return observation, reward, terminated, truncated, info

    def _next_generator(self, seed: int | None) -> np.random.Generator:
        """A generator for one episode: from the seed, or the next after the previous episode's."""
        if seed is None and self._seeds is None:
            # Never seeded: follow the seed that the environment drew, or any, if it knows none.
            drawn = self.env.unwrapped.np_random_seed
            seed = drawn if drawn >= 0 else None
        if seed is not None or self._seeds is None:
            self._seeds = estimator_seeds(seed)
        (child,) = self._seeds.spawn(1)
        return np.random.default_rng(child)


def _rig(env: gym.Env[Any, Any]) -> Rig:
    rig = getattr(env.unwrapped, "rig", None)
    if not isinstance(rig, Rig):
        raise ValueError(
            f"{env} has no `rig` of type grouser.rig.Rig ({rig!r}), which an estimator reads its "
            "calibration from; give the environment one"
        )
    return rig


def _dict_space(env: gym.Env[Any, Any]) -> spaces.Dict:
    space = env.observation_space
    if not isinstance(space, spaces.Dict):
        raise ValueError(
            f"EstimatedPose needs an observation space of type Dict, got {space}; apply it before "
            "wrappers that flatten or select observations"
        )
    taken = sorted(_pose_spaces().keys() & space.keys())
    if taken:
        raise ValueError(
            f"the observation already has {taken}; put one EstimatedPose around an environment"
        )
    return space


def _pose_spaces() -> dict[str, spaces.Space[Any]]:
    bound = np.array([_FAR, _FAR, np.pi])
    return {
        "pose": spaces.Box(-bound, bound, dtype=np.float64),
        "pose_covariance": spaces.Box(-_VARIANCE, _VARIANCE, (3, 3), dtype=np.float64),
    }


def _with_estimate(
    observation: Observation, info: dict[str, Any], estimate: PoseEstimate
) -> tuple[dict[str, Any], dict[str, Any]]:
    added = {"pose": estimate.pose.copy(), "pose_covariance": estimate.covariance.copy()}
    return {**observation, **added}, {**info, "pose_status": estimate.status.value}
