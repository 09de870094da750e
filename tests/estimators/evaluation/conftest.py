"""A tiny robot without physics, and estimators that betray what they were given."""

from collections.abc import Callable
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces

from grouser.estimators.base import Observation, PoseEstimate, PoseEstimator, Status
from grouser.geometry import Array, compose, lift
from grouser.rig import Rig, TrackGeometry

DT = 0.1


class PointRobot(gym.Env[dict[str, Any], Any]):
    """Does what its tracks say; shows them with noise, and a beacon that nobody needs."""

    observation_space = spaces.Dict(
        {
            "tracks": spaces.Box(-1.0, 1.0, (2,), np.float64),
            "stamp": spaces.Box(0.0, 1e6, (1,), np.float64),
            "beacon": spaces.Box(0.0, 1.0, (1,), np.float64),
        }
    )
    action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
    rig = Rig(dt=DT, tracks=TrackGeometry(gauge=0.4, width=0.08, effective_width=0.5))

    def __init__(self, length: int | None = None, truth: bool = True) -> None:
        self._length, self._truth = length, truth
        self.actions: list[Array] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        super().reset(seed=seed)
        self._pose, self._count, self._tracks = np.zeros(3), 0, np.zeros(2)
        return self._observe()

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        assert action in self.action_space
        self.actions.append(np.array(action))
        self._count += 1
        self._tracks = np.asarray(action, np.float64) * 0.5 * DT
        turn = (self._tracks[1] - self._tracks[0]) / 0.5
        self._pose = compose(self._pose, [self._tracks.mean(), 0.0, turn])
        observation, info = self._observe()
        return observation, 0.0, False, self._count == self._length, info

    def _observe(self) -> tuple[dict[str, Any], dict[str, Any]]:
        noisy = self._tracks + self.np_random.normal(0, 1e-3, 2)
        stamp = np.array([self._count * DT])
        observation = {"tracks": noisy, "stamp": stamp, "beacon": self.np_random.random(1)}
        truth = {"true_pose": self._pose.copy(), "true_pose_3d": lift(self._pose)}
        return observation, truth if self._truth else {}


class Witness(PoseEstimator):
    """Integrates the tracks, draws from its generator and keeps a record of all that it saw."""

    requires: ClassVar[frozenset[str]] = frozenset({"tracks", "stamp"})

    def __init__(self, status: Status = Status.TRACKING) -> None:
        self.seen: list[dict[str, bytes]] = []
        self._status = status

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        self.draws = rng.integers(0, 2**62, 3)
        self.seen, self._pose = [], np.zeros(3)
        return self._look(observation)

    def update(self, observation: Observation) -> PoseEstimate:
        tracks = observation["tracks"]
        turn = (tracks[1] - tracks[0]) / 0.5
        self._pose = compose(self._pose, [tracks.mean(), 0.0, turn])
        return self._look(observation)

    def _look(self, observation: Observation) -> PoseEstimate:
        self.seen.append({key: value.tobytes() for key, value in observation.items()})
        steps = len(self.seen) - 1
        return PoseEstimate(
            pose=self._pose.copy(),
            covariance=np.diag([1e-4, 1e-4, 1e-3]) * steps,
            status=self._status,
            stamp=float(observation["stamp"][0]),
        )


class Vandal(Witness):
    """Writes into what it is given to read."""

    def update(self, observation: Observation) -> PoseEstimate:
        estimate = super().update(observation)
        observation["tracks"][:] = 1e3
        return estimate


@pytest.fixture
def robot() -> Callable[..., PointRobot]:
    return PointRobot


@pytest.fixture
def witness() -> Callable[..., Witness]:
    return Witness


@pytest.fixture
def vandal() -> Callable[..., Vandal]:
    return Vandal
