"""GoalNav: ends by the truth, acts on the estimate, reads no more than it needs, leaks nothing."""

import hashlib
import json
import math
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded

import grouser  # noqa: F401  registers the environments
from grouser.agents.navigation import GoalNavEnv
from grouser.agents.waypoints import action_toward
from grouser.estimators.base import PoseEstimate, Status

FAST = {"dynamics": "fast"}


def nav(**options: Any) -> GoalNavEnv:
    return GoalNavEnv(**{"robot": FAST, **options})


def toward_goal(env: GoalNavEnv) -> Any:
    """Straight at the goal as the robot believes it: what it would take without obstacles."""
    return action_toward(env.believed, env.goal, env.rig)


def drive(env: GoalNavEnv, *, seed: int, steps: int = 60) -> list[Any]:
    """Observations, rewards and beliefs of a drive that depends on what is believed."""
    seen: list[Any] = [env.reset(seed=seed)[0]]
    for _ in range(steps):
        action = np.zeros(env.action_space.shape or (), dtype=np.float64)
        action[:2] = toward_goal(env)
        shown, reward, ended, late, _ = env.step(action.astype(np.float32))
        seen += [shown, {"reward": reward, "pose": env.believed.pose, "action": action}]
        if ended or late:
            break
    return seen


def digest(seen: list[Any]) -> str:
    total = hashlib.sha256()
    for shown in seen:
        for key in sorted(shown):
            total.update(key.encode() + np.ascontiguousarray(shown[key]).tobytes())
    return total.hexdigest()


def first_success(env: GoalNavEnv, seeds: int = 20) -> dict[str, Any]:
    """The last info of the first episode in which driving straight at the goal succeeds."""
    for seed in range(seeds):
        env.reset(seed=seed)
        ended, info = False, {"is_success": False}
        while not ended:
            _, _, terminated, truncated, info = env.step(toward_goal(env))
            ended = terminated or truncated
        if info["is_success"]:
            return {**info, "seed": seed}
    raise AssertionError("no straight way to any goal")


def test_a_drive_straight_to_a_goal_succeeds_and_scores() -> None:
    info = first_success(nav(estimator="ground-truth"))
    assert info["outcome"] == "success" and info["goals_reached"] == 1
    assert info["distance_to_goal"] <= 0.15 and info["progress"] > 0.9
    assert info["believed_distance_to_goal"] == pytest.approx(info["distance_to_goal"])
    assert 0.9 * info["shortest_path"] - 0.2 < info["path_length"] < 1.3 * info["shortest_path"]


def test_the_same_drive_with_a_pose_that_is_off_misses() -> None:
    class Off:
        """Believes itself at the goal, wherever it is."""

        def arrived(self, newest: PoseEstimate, time: float) -> PoseEstimate:
            return PoseEstimate(np.append(env.goal, 0.0), np.eye(3), Status.TRACKING, time)

    env = nav(estimator="ground-truth")
    env.reset(seed=0)
    env._delay = Off()  # type: ignore[assignment]
    _, reward, terminated, truncated, info = env.step(np.zeros(2, dtype=np.float32))
    assert (terminated, truncated, info["outcome"]) == (True, False, "missed")
    assert info["believed_distance_to_goal"] == 0 and info["distance_to_goal"] > 1
    assert reward == pytest.approx(-2.01, abs=0.02)


def test_a_lost_robot_does_not_take_itself_for_arrived() -> None:
    class Lost:
        def arrived(self, newest: PoseEstimate, time: float) -> PoseEstimate:
            return PoseEstimate(np.append(env.goal, 0.0), np.eye(3), Status.LOST, time)

    env = nav(estimator="ground-truth")
    env.reset(seed=0)
    env._delay = Lost()  # type: ignore[assignment]
    assert env.step(np.zeros(2, dtype=np.float32))[4]["outcome"] == "running"


def test_the_agent_may_say_stop() -> None:
    env = nav(stop="agent")
    env.reset(seed=0)
    assert env.action_space.shape == (3,)
    assert env.step(np.array([0, 0, -1], dtype=np.float32))[4]["outcome"] == "running"
    assert env.step(np.array([0, 0, 1], dtype=np.float32))[4]["outcome"] == "missed"


def test_arrival_counts_by_itself_where_asked_for() -> None:
    info = first_success(nav(estimator="dead-reckoning", stop="arrival"))
    assert 0.2 < info["distance_to_goal"] <= 0.3


def test_a_wall_ends_the_episode() -> None:
    env = nav()
    env.reset(seed=0)
    for _ in range(600):
        _, reward, terminated, truncated, info = env.step(np.ones(2, dtype=np.float32))
        if terminated or truncated:
            break
    assert info["outcome"] == "collision" and terminated and not truncated
    assert reward < -4


def test_time_runs_out_for_each_goal() -> None:
    for goals in (1, 3):
        env = nav(time_limit=0.5, goals=goals)
        env.reset(seed=0)
        still = np.zeros(2, dtype=np.float32)
        ends = [env.step(still)[2:4] for _ in range(5 * goals)]
        assert ends == [(False, False)] * (5 * goals - 1) + [(False, True)]


def test_after_a_goal_the_next_is_shown_and_time_goes_on() -> None:
    env = nav(estimator="ground-truth", goals=8)
    for seed in range(20):
        shown, _ = env.reset(seed=seed)
        first, ended, outcome = env.goal.copy(), False, "running"
        while not ended and outcome == "running":
            shown, reward, ended, _, info = env.step(toward_goal(env))
            outcome = info["outcome"]
        if outcome == "reached":
            break
    assert info["goals_reached"] == 1 and not ended and reward > 9.9
    assert info["distance_to_goal"] < 0.16 and not np.array_equal(env.goal, first)
    believed = math.dist(env.believed.pose[:2], env.goal)
    assert shown["goal"][0] == pytest.approx(believed / 10, rel=1e-5)
    assert 0 < info["progress"] < 0.9


def test_goals_are_the_worlds_and_the_seeds() -> None:
    env, goals = nav(goals=3), []
    for seed in (0, 1, 0):
        env.reset(seed=seed)
        goals.append(env.goal)
        x, y, heading = env.world.start
        c, s = math.cos(heading), math.sin(heading)
        at = env.goal @ np.array([[c, s], [-s, c]]) + (x, y)
        assert np.linalg.norm(env.world.goals - at, axis=1).min() < 1e-9
    assert np.array_equal(goals[0], goals[2]) and not np.array_equal(goals[0], goals[1])


@pytest.mark.parametrize(
    ("estimator", "policy", "asked"),
    [
        ("ground-truth", (), ()),
        ("dead-reckoning", ("lidar",), ("tracks", "lidar")),
        ("one-point-ransac", ("lidar",), ("left", "right", "tracks", "lidar")),
        ("one-point-ransac", (), ("left", "right", "tracks")),
        ("icr-ekf", (), ("tracks", "imu")),
    ],
)
def test_only_the_sensors_that_are_read_are_asked_for(
    estimator: str, policy: tuple[str, ...], asked: tuple[str, ...]
) -> None:
    env = nav(estimator=estimator, policy_sensors=policy)
    assert env.sensors == asked


def test_what_a_source_reads_is_asked_for_where_there_is_one() -> None:
    options = {"source": "scan-matching", "source_options": {"odometry": None}}
    env = nav(estimator="icr-ekf", estimator_options=options, policy_sensors=())
    assert env.sensors == ("left", "right", "tracks", "lidar", "imu")


def test_without_latency_a_run_is_that_of_no_delay_bit_for_bit() -> None:
    class Undelayed:
        def reset(self, first: PoseEstimate) -> PoseEstimate:
            return first

        def arrived(self, newest: PoseEstimate, time: float) -> PoseEstimate:
            return newest

    uncharged = nav(covariance=True)
    uncharged._delay = Undelayed()  # type: ignore[assignment]
    charged = nav(covariance=True, pose_latency=0.0)
    late = nav(covariance=True, pose_latency=0.3)
    runs = [digest(drive(env, seed=4)) for env in (uncharged, charged, late)]
    assert runs[0] == runs[1] != runs[2]


def test_a_late_pose_is_that_of_some_steps_ago() -> None:
    prompt, late = nav(estimator="ground-truth"), nav(estimator="ground-truth", pose_latency=0.3)
    prompt.reset(seed=0), late.reset(seed=0)
    now, then = [], []
    for _ in range(12):
        action = np.array([0.8, 0.5], dtype=np.float32)
        prompt.step(action), late.step(action)
        now.append(prompt.believed.pose)
        then.append(late.believed.pose)
    assert np.array_equal(then[3:], now[:-3]) and np.array_equal(then[:3], np.zeros((3, 3)))


class Garbled(gym.Wrapper[Any, Any, Any, Any]):
    """All that the robot's environment tells beside its sensors is garbage, but for the end."""

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        shown, info = self.env.reset(**options)
        return shown, self._garbage(info)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        shown, reward, terminated, truncated, info = self.env.step(action)
        return shown, math.nan, terminated, truncated, self._garbage(info)

    def _garbage(self, info: dict[str, Any]) -> dict[str, Any]:
        told = {key: np.full(np.shape(value), 1e3) for key, value in info.items()}
        return {**told, "collision": info["collision"], "true_pose": np.array([9.0, -9.0, 2.0])}


@pytest.mark.parametrize("estimator", ["dead-reckoning", "one-point-ransac", "ekf-line-slam"])
def test_garbage_for_the_truth_changes_no_observation_action_or_belief(estimator: str) -> None:
    honest, garbled = (nav(estimator=estimator, covariance=True) for _ in range(2))
    garbled._estimated.env = Garbled(garbled._robot)
    here, there = drive(honest, seed=3), drive(garbled, seed=3)
    assert len(here) == len(there) > 20
    for told in (*here, *there):
        told.pop("reward", None)  # that is the truth's, and no policy sees it
    assert digest(here) == digest(there)


PROCESS = """
import sys
sys.path.insert(0, sys.argv[1])
from test_navigation import digest, drive, nav
print(digest(drive(nav(estimator="one-point-ransac"), seed=5, steps=10)))
"""


def test_a_seed_fixes_a_drive_in_another_process() -> None:
    command = [sys.executable, "-c", PROCESS, str(Path(__file__).parent)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    here = digest(drive(nav(estimator="one-point-ransac"), seed=5, steps=10))
    assert done.stdout.split()[-1] == here


OPTIONS: dict[str, Any] = {
    "estimator": "ekf-line-slam",
    "estimator_options": {"jacobians": "right-invariant"},
    "world": "room",
    "pose_latency": 0.2,
    "covariance": True,
    "goals": 2,
    "reward": {"step": -0.02},
    "robot": {"dynamics": "fast", "effects": {"lidar.glass": 0.1}},
}


def test_its_spec_goes_through_json_and_pickle_and_makes_the_same_again() -> None:
    env = gym.make("grouser/GoalNav-v0", **OPTIONS)
    assert env.spec is not None
    told = env.spec.to_json()
    assert json.loads(told)["kwargs"]["estimator"] == "ekf-line-slam"
    twins = [
        gym.make(EnvSpec.from_json(told)),
        gym.make(pickle.loads(pickle.dumps(env.spec))),
        gym.make("grouser/GoalNav-v0", **OPTIONS),
    ]
    runs = [digest(drive(made.unwrapped, seed=2, steps=10)) for made in (env, *twins)]  # type: ignore[arg-type]
    assert len(set(runs)) == 1


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_a_vector_of_them_shows_what_each_alone_does(mode: str) -> None:
    options: dict[str, Any] = {"estimator": "dead-reckoning", "robot": FAST}
    several = gym.make_vec("grouser/GoalNav-v0", 2, vectorization_mode=mode, **options)
    several.reset(seed=[3, 4])  # type: ignore[arg-type]  # one a member
    actions = np.array([[0.5, 0.4], [0.1, 0.6]], dtype=np.float32)
    for _ in range(5):
        shown = several.step(actions)[0]
    several.close()
    for index, seed in enumerate((3, 4)):
        env = nav(**options)
        env.reset(seed=seed)
        for _ in range(5):
            alone = env.step(actions[index])[0]
        assert digest([{key: value[index] for key, value in shown.items()}]) == digest([alone])


def made_for_subprocess() -> gym.Env[Any, Any]:
    return gym.make("grouser/GoalNav-v0", robot=FAST)


def test_it_works_under_stable_baselines3s_subprocesses() -> None:
    vec_env = pytest.importorskip(
        "stable_baselines3.common.vec_env",
        reason="Stable-Baselines3 is not installed: pip install -e '.[rl]'",
    )
    several = vec_env.SubprocVecEnv([made_for_subprocess] * 2, start_method="fork")
    several.seed(3)
    several.reset()
    for _ in range(3):
        shown, _, _, infos = several.step(np.full((2, 2), 0.5, dtype=np.float32))
    assert shown["beams"].shape == (2, 36) and infos[0]["outcome"] == "running"
    several.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stop": "agnet"}, "no stop is named 'agnet'; did you mean 'agent'"),
        ({"time_limit": 0.0}, "time_limit must be positive and finite, s, got 0.0"),
        ({"goals": 0}, "goals must be a whole number of 1 or more, got 0"),
        ({"estimator": "one-point-ransack"}, "one-point-ransac"),
        ({"policy_sensors": ["gps"]}, "a policy cannot see 'gps'"),
        ({"reward": {"speed": 1.0}}, "no reward is named 'speed'; known: progress, success"),
        ({"robot": {"sensors": ["gps"]}}, r"robot= may not set \['sensors'\]"),
        ({"pose_latency": -1.0}, "pose_latency must be 0 s or more"),
    ],
)
def test_wrong_arguments_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        GoalNavEnv(**options)


def test_too_many_goals_are_refused_when_the_world_is_known() -> None:
    env = nav(goals=9)
    with pytest.raises(ValueError, match="'depot' has 8 goals, fewer than goals=9"):
        env.reset(seed=0)


def test_wrong_use_is_refused() -> None:
    env = nav()
    with pytest.raises(ResetNeeded, match=r"call reset\(\) before step\(\)"):
        env.step(np.zeros(2, dtype=np.float32))
    with pytest.raises(ResetNeeded):
        _ = env.believed
    env.reset(seed=0)
    for action in (np.zeros(3), np.array([np.nan, 0.0])):
        with pytest.raises(ValueError, match="an action is .* finite numbers: left and right"):
            env.step(action.astype(np.float32))
