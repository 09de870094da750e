"""Where a comparison gets its observations from: a simulated world or a recording."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import gymnasium as gym
import numpy as np

import grouser  # noqa: F401  (registers the environments)
from grouser.envs.replay import ReplayEnv
from grouser.estimators.base import TRUTH_KEYS
from grouser.geometry import Array

Env = gym.Env[Any, Any]

STEPS_IN_A_WORLD = 600
"""A minute at ten steps a second: twenty metres of driving."""


class Source(Protocol):
    """A kind of environment, before it is known which of its sensors are needed."""

    @property
    def label(self) -> str:
        """The `source` of results.json."""

    @property
    def settings(self) -> dict[str, Any]:
        """What must agree for results to be comparable."""

    @property
    def drivable(self) -> bool:
        """Whether actions have an effect."""

    @property
    def reference_sigmas(self) -> Array | None:
        """(3,) of x, y [m] and heading [rad] of what passes for the truth; None where it is."""

    def gives(self) -> frozenset[str]:
        """Every key that an estimator could be given, the truth among them where it is known."""

    def make(self, sensors: Iterable[str]) -> Env:
        """The environment with these sensors and no others."""

    def steps(self, asked: int | None) -> int:
        """How many steps a rollout takes when so many are asked for."""


@dataclass(frozen=True, slots=True)
class World:
    """grouser/TrackedRobot-v0 in one of its worlds, with further options of gym.make."""

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)
    drivable: bool = True
    reference_sigmas: None = None

    @property
    def label(self) -> str:
        return f"world:{self.name}"

    @property
    def settings(self) -> dict[str, Any]:
        return {"world": self.name, **self.options}

    def gives(self) -> frozenset[str]:
        # Imported here: a comparison on a recording needs no physics.
        from grouser.envs.sensors.suite import SENSORS

        return frozenset(SENSORS) | {"stamp"} | TRUTH_KEYS

    def make(self, sensors: Iterable[str]) -> Env:
        return gym.make(
            "grouser/TrackedRobot-v0", world=self.name, sensors=tuple(sensors), **self.options
        )

    def steps(self, asked: int | None) -> int:
        return STEPS_IN_A_WORLD if asked is None else asked


@dataclass(frozen=True, slots=True)
class Log:
    """grouser/Replay-v0 of a recording, with what the recording does not say of the rig."""

    path: Path
    rig: dict[str, Any]
    odometry_noise: float = 0.0
    reference_sigma: tuple[float, float] | None = None
    """Of a coordinate [m] and of the heading [degrees] of its reference poses."""
    drivable: bool = False

    @property
    def label(self) -> str:
        return f"log:{self.path.resolve().name}"

    @property
    def settings(self) -> dict[str, Any]:
        noise: dict[str, Any] = {}
        if self.odometry_noise:
            noise["odometry_noise"] = self.odometry_noise
        if self.reference_sigma is not None:
            noise["reference_sigma"] = list(self.reference_sigma)
        return {"log": str(self.path.resolve()), "rig": self.rig, **noise}

    @property
    def reference_sigmas(self) -> Array | None:
        if self.reference_sigma is None:
            return None
        position, heading = self.reference_sigma
        return np.array([position, position, np.radians(heading)])

    def gives(self) -> frozenset[str]:
        replay = self._open()
        truth = TRUTH_KEYS if replay.has_truth else frozenset()
        return frozenset(replay.recorded) | {"stamp"} | truth

    def make(self, sensors: Iterable[str]) -> Env:
        return gym.make(
            "grouser/Replay-v0",
            log=str(self.path),
            rig=self.rig,
            sensors=tuple(sensors),
            odometry_noise=self.odometry_noise,
        )

    def steps(self, asked: int | None) -> int:
        there = len(self._open()) - 1
        if asked is not None and asked > there:
            raise ValueError(f"--steps {asked} is too many: {self.path} has {there} steps")
        return there if asked is None else asked

    def _open(self) -> ReplayEnv:
        return ReplayEnv(self.path, rig=self.rig, odometry_noise=self.odometry_noise)
