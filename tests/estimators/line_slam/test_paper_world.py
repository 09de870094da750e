"""The filter in paper 2's world, against the levels of SPEC 2.4.

A few runs, with margins for so few; `grouser reproduce yan` does the whole count.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401
from grouser.agents.steering import SteeringDriver
from grouser.envs.line_world import LineWorldEnv
from grouser.estimators import PoseEstimate, Status, make
from grouser.estimators.base import readable
from grouser.estimators.line_slam.association import Pairs
from grouser.estimators.line_slam.estimator import EkfLineSlam
from grouser.estimators.line_slam.lines import line_through, lines_to_world
from grouser.estimators.line_slam.map import LineMap
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.geometry import Array, compose, wrap

RUNS = 6


@dataclass(frozen=True)
class Drive:
    errors: Array
    """(n, 3)"""
    nees: float
    line_map: LineMap
    wrong: int
    """Associations of a line that was seen with another one."""
    line_errors: Array
    """(lines, 2) of the map, m and rad."""
    right_end: float
    """Largest x of the third landmark in the map, in the paper's frame, m."""


class Witness:
    """Between the filter and its association: notes which true line was taken for which."""

    def __init__(self, estimator: EkfLineSlam, truth: Array) -> None:
        self.truth, self.pose = truth, np.zeros(3)
        self.seen: list[tuple[int, int]] = []
        self._inner = estimator._slam.filter._associate
        estimator._slam.filter._associate = self  # type: ignore[method-assign]

    def __call__(self, seen: LineMeasurements) -> Pairs:
        pairs = self._inner(seen)
        for line, z in zip(pairs.lines, seen.lines[pairs.seen], strict=True):
            self.seen.append((int(line), self.nearest(lines_to_world(z, self.pose))[0]))
        return pairs

    def nearest(self, line: Array) -> tuple[int, Array]:
        """The true line that it is, and how far it is off."""
        over = np.array([-line[0], line[1] + np.pi])
        apart = np.stack([line, over])[:, None] - self.truth
        apart[..., 1] = wrap(apart[..., 1])
        far = np.abs(apart) @ [0.05, 1.0]
        side, name = np.unravel_index(int(np.argmin(far)), far.shape)
        return int(name), np.abs(apart[side, name])


@cache
def drive(seed: int, world: str = "yan-normal", **options: Any) -> Drive:
    env = gym.make("grouser/LineWorld-v0", world=world, sensors=("steering", "lines")).unwrapped
    assert isinstance(env, LineWorldEnv)
    estimator = make("ekf-line-slam", env.rig, **options)
    assert isinstance(estimator, EkfLineSlam)
    observation, info = env.reset(seed=seed)
    estimator.reset(readable(estimator, observation, info), rng=np.random.default_rng(0))
    ends = env.world.segments_from_start.reshape(-1, 2, 2)
    witness = Witness(estimator, line_through(ends[:, 0], ends[:, 1]))
    driver = SteeringDriver(env.rig, env.world.course)
    errors, nees = [], []
    while True:
        truth = PoseEstimate(info["true_pose"], np.eye(3), Status.TRACKING, 0.0)
        if (action := driver(truth)) is None:
            break
        observation, *_, info = env.step(action.astype(np.float32))
        witness.pose = info["true_pose"]
        estimate = estimator.update(readable(estimator, observation, info))
        error = estimate.pose - info["true_pose"]
        error[2] = wrap(error[2])
        errors.append(error)
        if len(errors) > 40:  # at the start the pose is known exactly
            nees.append(float(error @ np.linalg.solve(estimate.covariance, error)))
    line_map = estimator.map
    named = [witness.nearest(line) for line in line_map.lines]
    wrong = sum(named[line][0] != name for line, name in witness.seen)
    third = next(i for i, (name, _) in enumerate(named) if name == 2)
    placed = np.column_stack([line_map.ends[third], np.zeros(2)])
    right_end = float(compose(info["start_pose"], placed)[:, 0].max())
    off = np.array([error for _, error in named])
    return Drive(np.array(errors), float(np.mean(nees)), line_map, wrong, off, right_end)


def rms(run: Drive) -> float:
    return float(np.sqrt(np.mean(np.sum(run.errors[:, :2] ** 2, axis=1))))


@pytest.fixture(scope="module")
def normal() -> list[Drive]:
    return [drive(seed) for seed in range(RUNS)]


def test_it_is_as_near_as_the_prototype_and_as_sure_as_it_may_be(normal: list[Drive]) -> None:
    assert np.mean([rms(run) for run in normal]) < 0.35
    assert np.mean([np.linalg.norm(run.errors[-1, :2]) for run in normal]) < 0.2
    assert 1.5 < np.mean([run.nees for run in normal]) < 5


def test_the_map_has_the_four_lines_and_took_none_for_another(normal: list[Drive]) -> None:
    assert [len(run.line_map) for run in normal] == [4] * RUNS
    assert [run.wrong for run in normal] == [0] * RUNS
    off = np.mean([run.line_errors for run in normal], axis=(0, 1))
    assert off[0] < 0.5 and np.degrees(off[1]) < 1.5


def test_a_line_beyond_the_range_is_known_as_far_as_it_was_seen() -> None:
    runs = [drive(seed, "yan-over-range") for seed in range(3)]
    ends = [run.right_end for run in runs]
    assert 53.8 < np.mean(ends) < 54.8 and max(ends) < 56  # of 60
    assert all(run.line_map.open_ends.any() for run in runs)


def test_the_normal_line_ends_where_it_ends(normal: list[Drive]) -> None:
    assert 45 <= np.mean([run.right_end for run in normal]) <= 46


def test_the_printed_jacobians_are_worse_and_too_sure(normal: list[Drive]) -> None:
    printed = [drive(seed, paper=True) for seed in range(RUNS)]
    assert np.mean([run.nees for run in printed]) > 3 * np.mean([run.nees for run in normal])
    assert np.mean([rms(run) for run in printed]) > np.mean([rms(run) for run in normal])


@pytest.mark.parametrize("jacobians", ["first-estimates", "right-invariant"])
def test_the_other_filters_are_as_good_where_the_heading_is_known(
    jacobians: str, normal: list[Drive]
) -> None:
    runs = [drive(seed, jacobians=jacobians) for seed in range(2)]
    assert np.mean([rms(run) for run in runs]) < 1.3 * np.mean([rms(run) for run in normal[:2]])
    assert max(run.nees for run in runs) < 8


def test_without_noise_the_farthest_that_was_visible_is_that_of_the_paper() -> None:
    """SPEC 2.4: 54.166 +- .01; the filter knows it as far as it is told of noise."""
    env = gym.make("grouser/LineWorld-v0", world="yan-over-range", noise=0.0).unwrapped
    assert isinstance(env, LineWorldEnv)
    _, info = env.reset(seed=0)
    driver, farthest = SteeringDriver(env.rig, env.world.course), 0.0
    while True:
        truth = PoseEstimate(info["true_pose"], np.eye(3), Status.TRACKING, 0.0)
        if (action := driver(truth)) is None:
            break
        *_, info = env.step(action.astype(np.float32))
        farthest = max(farthest, float(info["true_visible"][2, [0, 2]].max()))
    assert farthest == pytest.approx(54.166, abs=0.01)
