"""Every registered estimator keeps the contract, and the check sees those that do not."""

import copy
import dataclasses
from typing import Any, ClassVar

import numpy as np
import pytest

from grouser.estimators import PoseEstimate, PoseEstimator, Status, names, register, registry
from grouser.estimators.base import Observation
from grouser.estimators.conformance import check_pose_estimator
from grouser.estimators.dead_reckoning import DeadReckoning
from grouser.rig import Rig


@pytest.mark.parametrize("name", names())
def test_registered_estimators_keep_the_contract(name: str) -> None:
    check_pose_estimator(name)


class Sighted(PoseEstimator):
    """Keeps the contract: dead reckoning that a lidar return supports."""

    requires: ClassVar[frozenset[str]] = frozenset({"tracks", "stamp", "lidar"})

    def __init__(self, rig: Rig) -> None:
        assert rig.lidar is not None
        self.range_max = rig.lidar.range_max
        self.inner = DeadReckoning(rig)

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        self.rng = rng
        return self.judge(self.inner.reset(observation, rng=rng), observation)

    def update(self, observation: Observation) -> PoseEstimate:
        return self.judge(self.inner.update(observation), observation)

    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        seen = bool((observation["lidar"] < self.range_max).any())
        return dataclasses.replace(estimate, status=Status.TRACKING if seen else Status.COASTING)


class Unseeded(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        noise = 1e-9 * np.random.default_rng().random(3) * (estimate.stamp > 0)
        return dataclasses.replace(super().judge(estimate, observation), pose=estimate.pose + noise)


class NeverResets(Sighted):
    started: PoseEstimate | None = None

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        if self.started is None:
            self.started = super().reset(observation, rng=rng)
        return copy.deepcopy(self.started)


class SinglePrecision(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        pose: Any = estimate.pose.astype(np.float32)
        return dataclasses.replace(super().judge(estimate, observation), pose=pose)


class WrongShape(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        estimate = super().judge(estimate, observation)
        return dataclasses.replace(estimate, covariance=np.diag(estimate.covariance).copy())


class Undefined(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        P = np.full((3, 3), np.nan)
        return dataclasses.replace(super().judge(estimate, observation), covariance=P)


class Asymmetric(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        P = estimate.covariance + np.triu(np.full((3, 3), 1e-4), 1)
        return dataclasses.replace(super().judge(estimate, observation), covariance=P)


class Indefinite(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        P = np.diag([1.0, -1e-3, 1.0])
        return dataclasses.replace(super().judge(estimate, observation), covariance=P)


class Unwrapped(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        pose = estimate.pose + [0, 0, 2 * np.pi * (estimate.stamp > 0)]
        return dataclasses.replace(super().judge(estimate, observation), pose=pose)


class StartsElsewhere(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        pose = estimate.pose + [0.01, 0, 0]
        return dataclasses.replace(super().judge(estimate, observation), pose=pose)


class WrongStamp(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        return dataclasses.replace(super().judge(estimate, observation), stamp=0.0)


class Chatty(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        words: Any = {"mood": "fine"}
        return dataclasses.replace(super().judge(estimate, observation), diagnostics=words)


class ReusesItsArray(Sighted):
    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        self.pose = np.zeros(3)

    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        self.pose[:] = estimate.pose
        return dataclasses.replace(super().judge(estimate, observation), pose=self.pose)


class HandsOutTheObservation(Sighted):
    requires: ClassVar[frozenset[str]] = Sighted.requires | {"imu"}

    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        shown = observation["imu"][:3]
        shown[:] = estimate.pose
        return dataclasses.replace(super().judge(estimate, observation), pose=shown)


class ChangesTheObservation(Sighted):
    def update(self, observation: Observation) -> PoseEstimate:
        estimate = super().update(observation)
        observation["lidar"][0] = 0.0
        return estimate


class KeepsTheObservation(Sighted):
    """Uses each increment one frame late, straight from the observation that it kept."""

    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        self.kept = observation
        return super().reset(observation, rng=rng)

    def update(self, observation: Observation) -> PoseEstimate:
        late = {**observation, "tracks": self.kept["tracks"]}
        self.kept = observation
        return super().update(late)


class HandsOutItsState(Sighted):
    """Its pose is never the same array twice, but the one it goes on from."""

    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        return dataclasses.replace(super().judge(estimate, observation), pose=self.inner._pose)


class StandsStill(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        return dataclasses.replace(super().judge(estimate, observation), pose=np.zeros(3))


class TurnsTheWrongWay(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        pose = estimate.pose * [1, -1, -1]
        return dataclasses.replace(super().judge(estimate, observation), pose=pose)


class SeesInTheDark(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        return dataclasses.replace(estimate, status=Status.TRACKING)


class NeverSees(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        return dataclasses.replace(estimate, status=Status.COASTING)


class FailsInTheDark(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        estimate = super().judge(estimate, observation)
        if estimate.status is Status.COASTING:
            raise ZeroDivisionError("no beams")
        return estimate


class CannotStartInTheDark(Sighted):
    def reset(self, observation: Observation, *, rng: np.random.Generator) -> PoseEstimate:
        if not (observation["lidar"] < self.range_max).any():
            raise RuntimeError("no first scan")
        return super().reset(observation, rng=rng)


class GrowsSure(Sighted):
    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        P = np.eye(3) / (1 + estimate.stamp)
        return dataclasses.replace(super().judge(estimate, observation), covariance=P)


class NeverRecovers(Sighted):
    gave_up = False

    def judge(self, estimate: PoseEstimate, observation: Observation) -> PoseEstimate:
        estimate = super().judge(estimate, observation)
        self.gave_up = estimate.stamp > 0 and (
            self.gave_up or estimate.status is not Status.TRACKING
        )
        return dataclasses.replace(
            estimate, status=Status.LOST if self.gave_up else estimate.status
        )


class CannotBePickled(Sighted):
    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        self.helper = lambda: rig


class ForgetsWhenPickled(Sighted):
    def __getstate__(self) -> dict[str, Any]:
        kept = dict(self.__dict__)
        kept["inner"] = copy.copy(self.inner)
        kept["inner"]._pose = np.zeros(3)
        return kept


class UnknownKey(Sighted):
    requires: ClassVar[frozenset[str]] = Sighted.requires | {"radar"}


class NoStamp(Sighted):
    requires: ClassVar[frozenset[str]] = frozenset({"tracks", "lidar"})


class PlainSet(Sighted):
    optional: ClassVar[Any] = {"imu"}


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_registry", dict(registry._registry))


@pytest.mark.usefixtures("registered")
def test_an_estimator_that_keeps_the_contract_passes() -> None:
    register("sighted", f"{__name__}:Sighted")
    check_pose_estimator("sighted")


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize(
    ("broken", "words"),
    [
        (Unseeded, "another instance, same generator, differs at"),
        (NeverResets, "the same instance, after reset, differs at"),
        (SinglePrecision, "frame 0: pose must be a float64 array"),
        (WrongShape, r"covariance must have shape \(3, 3\), got \(3,\)"),
        (Undefined, "covariance is not finite"),
        (Asymmetric, "covariance is not symmetric"),
        (Indefinite, "covariance has the negative eigenvalue -0.001"),
        (Unwrapped, r"frame 1: heading 6\.\d+ is not wrapped"),
        (StartsElsewhere, "reset must start at pose zero"),
        (WrongStamp, "frame 1: stamp is 0.0, not 0.1"),
        (Chatty, "diagnostic 'mood' is no number: 'fine'"),
        (ReusesItsArray, "frame 1: pose shares memory with pose of the frame before"),
        (HandsOutTheObservation, "frame 0: pose shares memory with 'imu'"),
        (ChangesTheObservation, "frame 1: it changed the observation 'lidar'"),
        (KeepsTheObservation, "observations and estimates are overwritten after each call, diff"),
        (HandsOutItsState, "observations and estimates are overwritten after each call, differs"),
        (StandsStill, "are frames .* mixed up"),
        (TurnsTheWrongWay, "are frames .* mixed up"),
        (SeesInTheDark, "blackout ended in Status.TRACKING"),
        (NeverSees, "after 16 frames in full light it is Status.COASTING"),
        (FailsInTheDark, "frame 16 of the blackout raised ZeroDivisionError"),
        (CannotStartInTheDark, "of the blackout raised RuntimeError"),
        (GrowsSure, "the variance of position went from"),
        (NeverRecovers, "10 frames after the blackout it is Status.LOST"),
        (CannotBePickled, "it cannot be pickled"),
        (ForgetsWhenPickled, "a pickled copy, from the middle on, differs at 0.8 s"),
        (UnknownKey, r"`requires` has unknown keys \['radar'\]; known: \['gps', 'imu'"),
        (NoStamp, "`requires` must include 'stamp'"),
        (PlainSet, "`optional` must be a frozenset"),
    ],
)
def test_the_check_catches(broken: type[PoseEstimator], words: str) -> None:
    register("broken", f"{__name__}:{broken.__name__}")
    with pytest.raises(AssertionError, match=f"broken: .*{words}"):
        check_pose_estimator("broken")
