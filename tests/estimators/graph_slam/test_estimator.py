"""graph-line-slam: loops close where they should, twins do not turn the map, real logs."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.estimators.base import Status
from grouser.estimators.evaluation.metrics import ate_se2
from grouser.estimators.graph_slam.estimator import GraphLineSlam
from grouser.estimators.graph_slam.loops import LoopOptions, shared_view
from grouser.estimators.graph_slam.verification import FitOptions
from grouser.estimators.scan_matching.matcher import ScanMatch, ScanMatcher
from grouser.geometry import Array, between, compose, wrap
from grouser.rig import Rig
from grouser.rig_motion import Odometry
from tests.estimators.line_slam.walls import lidar, polygon, seen

SENSOR = lidar(range_max=8.0)
RIG = Rig(dt=0.5, lidar=SENSOR, odometry=Odometry())
ROOM = 3.4
"""m from one room to its twin"""


def twin_rooms(n: int) -> Array:
    """Walls (k, 2, 2) of n rooms that are the same, side by side along a corridor."""
    walls = [
        [[-2, -1], [n * ROOM + 2, -1]],
        [[-2, -1], [-2, 0.9]],
        [[n * ROOM + 2, -1], [n * ROOM + 2, 0.9]],
        [[-2, 0.9], [0, 0.9]],
        [[n * ROOM, 0.9], [n * ROOM + 2, 0.9]],
        [[0, 5.1], [n * ROOM, 5.1]],
        [[0, 0.9], [0, 5.1]],
    ]
    for k in range(n):
        x = k * ROOM
        walls += [
            [[x, 0.9], [x + 1.1, 0.9]],
            [[x + 2.3, 0.9], [x + ROOM, 0.9]],
            [[x + ROOM, 0.9], [x + ROOM, 5.1]],
            [[x + 0.4, 4.0], [x + 0.9, 4.3]],
            [[x + 2.6, 3.0], [x + 2.6, 3.6]],
            [[x + 2.6, 3.6], [x + 3.1, 3.6]],
        ]
    return np.array(walls, dtype=np.float64)


def crossing() -> Array:
    """Walls (k, 2, 2) of four blocks, each with a niche of its own, within a square."""
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    walls = [polygon(9.5 * square)]
    for k, corner in enumerate(square):
        walls += [polygon(4.0 * corner + 2.5 * square)]
        for along in (0.3 + 0.4 * k, 3.1 - 0.5 * k):
            walls += [polygon([1.5, 1.5 + along] * corner + [0.4, 0.3 + 0.1 * k] * square)]
    return np.concatenate(walls)


def way(rooms: list[int]) -> Array:
    """(n, 3) poses in the frame of the walls, into each room and out again."""
    corners = [(-1.0, 0.0)]
    for k in rooms:
        x = k * ROOM + 1.7
        corners += [(x, 0.0), (x, 3.0), (x, 0.0)]
    return between_corners(corners)


def between_corners(corners: list[tuple[float, float]]) -> Array:
    """(n, 3) poses on the way from corner to corner."""
    poses = [np.array([*corners[0], 0.0])]
    for a, b in zip(corners, corners[1:], strict=False):
        heading = np.arctan2(b[1] - a[1], b[0] - a[0])
        turn = float(wrap(heading - poses[-1][2]))
        for _ in range(int(np.ceil(abs(turn) / 0.25))):
            poses.append(compose(poses[-1], [0, 0, turn / np.ceil(abs(turn) / 0.25)]))
        length = np.hypot(b[0] - a[0], b[1] - a[1])
        for _ in range(int(np.ceil(length / 0.4))):
            poses.append(compose(poses[-1], [length / np.ceil(length / 0.4), 0, 0]))
    return np.array(poses)


def driven(
    walls: Array, poses: Array, seed: int, bias: float, rig: Rig = RIG
) -> tuple[GraphLineSlam, list[Any]]:
    """The estimator after a drive whose odometry turns by `bias` [rad/m] too much."""
    assert rig.lidar is not None
    rng = np.random.default_rng(seed)
    estimator, estimates = GraphLineSlam(rig), []
    for k, pose in enumerate(poses):
        motion = between(poses[k - 1], pose) if k else np.zeros(3)
        way = np.hypot(motion[0], motion[1])
        off = rng.normal(size=3) * [0.02, 0.02, 0.02] * way + [0, 0, bias * way]
        observation = {
            "lidar": seen(walls, rig.lidar, pose, rng),
            "odometry": compose(motion, off) if k else motion,
            "stamp": np.array([0.5 * k]),
        }
        if k == 0:
            estimates.append(estimator.reset(observation, rng=np.random.default_rng(0)))
        else:
            estimates.append(estimator.update(observation))
    return estimator, estimates


def loop_errors(estimator: GraphLineSlam, truth: Array) -> Array:
    """(k,) m by which each loop is wrong."""
    return np.array(
        [
            np.hypot(*between(between(truth[i], truth[j]), pose)[:2])
            for i, j, pose in estimator.closures
        ]
    )


@pytest.mark.parametrize("bias", [0.0, 0.06])
def test_twin_rooms_are_not_taken_for_each_other(bias: float) -> None:
    poses = way([0, 1, 2, 3, 4])
    estimator, estimates = driven(twin_rooms(5), poses, 1, bias)
    assert (loop_errors(estimator, poses) < 0.3).all()
    truth = between(poses[0], poses)
    assert np.hypot(*(estimates[-1].pose - truth[-1])[:2]) < 0.3


def test_a_room_that_is_met_again_closes_the_loop() -> None:
    poses = way([0, 2, 4, 0, 2])
    estimator, estimates = driven(twin_rooms(5), poses, 2, 0.06)
    errors = loop_errors(estimator, poses)
    assert len(errors) >= 6 and errors.max() < 0.3
    assert estimates[-1].diagnostics["loops"] == len(errors)
    truth, trajectory = between(poses[0], poses), estimator.trajectory
    assert trajectory.shape == poses.shape and not trajectory[0].any()
    assert ate_se2(truth, trajectory) < 0.1
    e = estimates[-1].pose - truth[-1]
    e[2] = wrap(e[2])
    assert e @ np.linalg.solve(estimates[-1].covariance, e) < 16, "the covariance is honest"
    assert all(e.status is Status.TRACKING for e in estimates)


@pytest.mark.parametrize("field_of_view", [np.pi, 2 * np.pi])
def test_a_way_that_is_crossed_closes_the_loop(field_of_view: float) -> None:
    """A place is the same place when it is seen at a right angle to the first time."""
    rig = replace(RIG, lidar=lidar(fov=field_of_view, start=-field_of_view / 2, range_max=8.0))
    poses = between_corners([(-8, 0), (8, 0), (8, 8), (0, 8), (0, -8)])
    estimator, _ = driven(crossing(), poses, 3, 0.03, rig)
    errors = loop_errors(estimator, poses)
    turns = np.array([abs(pose[2]) for _, _, pose in estimator.closures])
    assert len(errors) >= 4 and errors.max() < 0.3
    assert (turns > np.radians(80)).sum() >= 4
    assert ate_se2(between(poses[0], poses), estimator.trajectory) < 0.1


def test_a_view_is_shared_less_the_more_it_turns_unless_it_is_all_around() -> None:
    turns = np.radians([0, 60, 90, 180])
    assert shared_view(turns, np.pi) == pytest.approx([1, 2 / 3, 1 / 2, 0])
    assert shared_view(turns, 2 * np.pi) == pytest.approx(1)
    assert shared_view(turns, 1.5 * np.pi) == pytest.approx([1, 7 / 9, 2 / 3, 2 / 3])


def test_a_scan_in_doubt_is_not_kept_as_long_as_one_can_wait(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where it was taken is known no better than what search and alignment differ by."""
    doubt, match = np.array([0.1, 0.0, 0.2]), ScanMatcher.match

    def doubtful(*args: Any) -> ScanMatch:
        return replace(match(*args), doubt=doubt)

    poses = between_corners([(-8, 0), (-2, 0)])
    _, sure = driven(crossing(), poses, 3, 0.03)
    monkeypatch.setattr(ScanMatcher, "match", doubtful)
    _, unsure = driven(crossing(), poses, 3, 0.03)
    assert sure[-1].diagnostics["keyframes"] >= 6.0 // 0.8, "every second scan, of 0.4 m each"
    assert 3 <= unsure[-1].diagnostics["keyframes"] <= 1 + 6.0 // 2.0, "one in 2 m"
    assert unsure[1].covariance[2, 2] > doubt[2] ** 2 > sure[1].covariance[2, 2]


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match=r"graph-line-slam needs rig.lidar, and this rig has None"):
        GraphLineSlam(Rig(dt=0.1, odometry=Odometry()))
    with pytest.raises(ValueError, match=r"line SLAM needs one of rig.steering, rig.tracks, rig"):
        GraphLineSlam(Rig(dt=0.1, lidar=SENSOR))
    with pytest.raises(ValueError, match=r"keyframe_distance must be positive, got 0"):
        GraphLineSlam(RIG, keyframe_distance=0.0)
    with pytest.raises(ValueError, match=r"LoopOptions.near must be positive, got -1"):
        LoopOptions(near=-1)
    with pytest.raises(ValueError, match=r"LoopOptions.overlap must be below 1, got 1.5"):
        LoopOptions(overlap=1.5)
    with pytest.raises(ValueError, match=r"FitOptions.score must be positive, got 0"):
        FitOptions(score=0)
    with pytest.raises(RuntimeError, match=r"call reset\(\) with the first observation first"):
        _ = GraphLineSlam(RIG).trajectory


@pytest.mark.parametrize(("name", "ate_m"), [("freiburg-101", 0.06), ("aces", 0.13)])
def test_real_logs_close_their_loops_and_no_others(carmen: Path, name: str, ate_m: float) -> None:
    env = gym.make("grouser/Replay-v0", log=str(carmen / f"{name}.log"), odometry_noise=0.02)
    estimator = GraphLineSlam(env.get_wrapper_attr("rig"))
    observation, info = env.reset(seed=1)
    estimator.reset(observation, rng=np.random.default_rng(0))
    poses, truncated = [info["true_pose"]], False
    while not truncated:
        observation, _, _, truncated, info = env.step(np.zeros(2, np.float32))
        estimator.update(observation)
        poses.append(info["true_pose"])
    errors = loop_errors(estimator, np.array(poses))
    assert len(errors) > 20 and errors.max() < 0.4
    assert ate_se2(np.array(poses), estimator.trajectory) <= ate_m
