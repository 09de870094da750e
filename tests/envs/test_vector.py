"""Vectors of robots: the bits of single ones, whatever happens to their processes."""

import multiprocessing
import os
import signal
import time
from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import AlreadyPendingCallError, ClosedEnvironmentError, NoAsyncCallError
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, VectorEnv

import grouser  # noqa: F401 - registers the environments
from grouser.envs.fleet import team
from grouser.envs.fleet.robot_vector import RobotVectorEnv
from grouser.envs.fleet.shares import processors
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.envs.vector import tracked_robots

ID = "grouser/TrackedRobot-v0"
OPTIONS: dict[str, Any] = {"sensors": ["left", "imu"], "image_size": [64, 48], "dynamics": "fast"}
BLIND: dict[str, Any] = {"sensors": ["imu"], "dynamics": "fast"}
FORWARD = np.full((3, 2), 0.5, np.float32)


@pytest.fixture(autouse=True)
def two_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever this machine has."""
    monkeypatch.setattr(team, "n_crews", lambda num_envs: min(num_envs, 2))


@pytest.fixture
def three() -> Iterator[RobotVectorEnv]:
    vector = tracked_robots(3, **BLIND)
    yield vector
    vector.close(terminate=True)


def same(one: Any, other: Any) -> bool:
    """Whether two results have the same types and bits, NaN included."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple) or (isinstance(one, np.ndarray) and one.dtype == object):
        return all(same(a, b) for a, b in zip(one, other, strict=True))
    if isinstance(one, np.ndarray):
        alike = one.dtype == other.dtype and one.shape == other.shape
        return bool(alike and one.tobytes() == other.tobytes())
    return type(one) is type(other) and bool(one == other)


def test_gymnasium_makes_it_by_default() -> None:
    vector = gym.make_vec(ID, 3, **OPTIONS)
    assert isinstance(vector, RobotVectorEnv) and vector.spec is not None
    assert vector.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    shown = [vector.reset(seed=5)[0], vector.step(FORWARD)[0]]
    assert shown[1] in vector.observation_space
    env = TrackedRobotEnv(**OPTIONS)
    for index in range(3):
        alone = [env.reset(seed=5 + index)[0], env.step(FORWARD[index])[0]]
        for one, together in zip(alone, shown, strict=True):
            assert all(np.array_equal(one[key], together[key][index]) for key in one)
    vector.close()
    env.close()


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_everything_is_as_in_gymnasiums_own(mode: AutoresetMode) -> None:
    """Observations, rewards, ends and infos, across the ends of episodes and partial resets."""
    options = OPTIONS | {"max_episode_steps": 2}
    ours = tracked_robots(3, autoreset_mode=mode, **options)
    theirs = AsyncVectorEnv([lambda: gym.make(ID, **options)] * 3, autoreset_mode=mode)
    vectors: list[VectorEnv[Any, Any, Any]] = [ours, theirs]
    assert ours.observation_space == theirs.observation_space
    assert ours.single_observation_space == theirs.single_observation_space
    assert ours.action_space == theirs.action_space and ours.metadata == theirs.metadata

    def alike(results: list[Any]) -> bool:
        return all(same(a, b) for a, b in zip(*results, strict=True))

    assert alike([vector.reset(seed=7) for vector in vectors])
    for _ in range(2 if mode is AutoresetMode.DISABLED else 6):
        assert alike([vector.step(FORWARD) for vector in vectors])
    for named in ([True, False, True], [False, True, False]):
        mask = {"reset_mask": np.array(named)}
        assert alike([vector.reset(seed=9, options=dict(mask)) for vector in vectors])
    for vector in vectors:
        vector.close()


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_every_start_method_gives_the_same(method: str) -> None:
    vector = tracked_robots(2, context=method, **OPTIONS)
    env = TrackedRobotEnv(**OPTIONS)
    shown = vector.reset(seed=0)[0]
    for index in range(2):
        assert np.array_equal(shown["left"][index], env.reset(seed=index)[0]["left"])
    vector.close()
    env.close()


def test_alone_or_with_a_process_for_each_it_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = []
    for crews in (1, 2, 3):
        monkeypatch.setattr(team, "n_crews", lambda num_envs, n=crews: n)
        vector = tracked_robots(3, **BLIND)
        assert len(vector.processes) == crews - 1
        shown.append((vector.reset(seed=1), vector.step(FORWARD)))
        vector.close()
    assert same(shown[0], shown[1]) and same(shown[0], shown[2])


def test_what_was_returned_stays_unless_asked_otherwise() -> None:
    for copy in (True, False):
        vector = tracked_robots(2, copy=copy, **BLIND)
        before, infos = vector.reset(seed=0)
        kept, pose = before["imu"].copy(), infos["true_pose"].copy()
        for _ in range(3):
            vector.step(FORWARD[:2])
        assert np.array_equal(before["imu"], kept) == copy
        assert np.array_equal(infos["true_pose"], pose), "only observations are written over"
        vector.close()


def test_attributes_and_calls_reach_every_environment(three: RobotVectorEnv) -> None:
    three.reset(seed=[4, 5, 6])
    assert three.np_random_seed == (4, 5, 6)
    three.set_attr("nickname", ["a", "b", "c"])
    assert three.get_attr("nickname") == ("a", "b", "c")
    three.set_attr("nickname", 7)
    assert three.call("get_wrapper_attr", "nickname") == (7, 7, 7)
    assert three.render() == (None, None, None)
    with pytest.raises(ValueError, match="vector of 3 takes as many values of nickname, got 2"):
        three.set_attr("nickname", [1, 2])
    with pytest.raises(ValueError, match=r"vector's own step\(\) instead of call\('step'\)"):
        three.call("step", FORWARD[0])


# --- one thing at a time -------------------------------------------------------------------------


def test_a_step_can_be_begun_and_ended(three: RobotVectorEnv) -> None:
    three.reset(seed=0)
    with pytest.raises(NoAsyncCallError, match=r"step_wait\(\) comes after step_async\(\)"):
        three.step_wait()
    three.step_async(FORWARD)
    with pytest.raises(AlreadyPendingCallError, match=r"before step_wait\(\) has ended step"):
        three.reset()
    assert three.step_wait(timeout=60)[0]["imu"].shape == (3, 6)


def test_a_wait_that_timed_out_may_be_done_again() -> None:
    vector = RobotVectorEnv([Sleeper] * 2, info={})
    vector.reset()
    vector.step_async(np.array([0.0, 0.6]))
    with pytest.raises(multiprocessing.TimeoutError, match="not all environments were ready"):
        vector.step_wait(timeout=0.05)
    assert vector.step_wait(timeout=60)[1].tolist() == [0.0, 0.6]
    vector.step_async(np.array([0.0, 60.0]))
    start = time.monotonic()
    vector.close(timeout=0.05)
    assert time.monotonic() - start < 5
    with pytest.raises(ClosedEnvironmentError, match="closed; make a new one"):
        vector.step(FORWARD[:2])


class Sleeper(gym.Env[Any, Any]):
    """Sleeps as long as it is told, and is rewarded for it."""

    observation_space = gym.spaces.Dict({"x": gym.spaces.Box(0.0, 1.0, (1,))})
    action_space = gym.spaces.Box(0.0, 100.0, ())

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        return {"x": np.zeros(1, np.float32)}, {}

    def step(self, action: Any) -> Any:
        time.sleep(float(action))
        return {"x": np.zeros(1, np.float32)}, float(action), False, False, {}


# --- what goes wrong -----------------------------------------------------------------------------


@pytest.mark.parametrize("index", [0, 2])
def test_an_error_of_an_environment_comes_to_the_caller(three: RobotVectorEnv, index: int) -> None:
    three.reset(seed=0)
    wrong = FORWARD.copy()
    wrong[index] = np.nan
    with pytest.raises(ValueError, match="two finite numbers") as raised:
        three.step(wrong)
    if index == 2:  # which another process steps
        assert "in checked_action" in str(raised.value.__cause__)
    assert np.isfinite(three.step(FORWARD)[0]["imu"]).all(), "the vector goes on"


def test_it_says_what_it_does_not_take(three: RobotVectorEnv) -> None:
    with pytest.raises(ValueError, match="vector of 3 takes as many seeds, got 2"):
        three.reset(seed=[1, 2])
    with pytest.raises(ValueError, match="vector of 3 takes as many actions, got 2"):
        three.step(FORWARD[:2])
    with pytest.raises(ValueError, match=r"reset takes no options, got \['easy'\]"):
        three.reset(options={"easy": True})
    with pytest.raises(TypeError, match="must be a NumPy array of bool"):
        three.reset(options={"reset_mask": [True, False, False]})
    with pytest.raises(ValueError, match="must name some of 3 environments"):
        three.reset(options={"reset_mask": np.zeros(3, dtype=bool)})
    with pytest.raises(ValueError, match="no world is named"):
        tracked_robots(2, world="nowhere")


def test_a_killed_process_is_noticed(three: RobotVectorEnv) -> None:
    three.reset(seed=0)
    (process,) = three.processes
    os.kill(process.pid, signal.SIGKILL)
    for _ in range(2):
        with pytest.raises(RuntimeError, match=r"has ended \(exit code -9\).*make a new one"):
            three.step(FORWARD)
    three.close()


def test_closing_ends_the_processes() -> None:
    vector = tracked_robots(3, **BLIND)
    processes = vector.processes
    vector.reset(seed=0)
    vector.close()
    vector.close()
    assert [process.exitcode for process in processes] == [0]
    forgotten = tracked_robots(3, **BLIND)
    (process,) = forgotten.processes
    del forgotten
    assert not process.is_alive()


# --- processors ----------------------------------------------------------------------------------

needs_affinity = pytest.mark.skipif(
    not hasattr(os, "sched_getaffinity"), reason="this system does not let processes choose"
)


@needs_affinity
@pytest.mark.parametrize("of", [1, 2, 3, 5, 8, 20])
def test_processors_are_dealt_out_fairly(of: int, monkeypatch: pytest.MonkeyPatch) -> None:
    own = {2, 3, 5, 7, 11, 13, 17, 19}
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: own)
    shares = [processors(index, of) for index in range(of)]
    assert frozenset().union(*shares) == own and all(shares)
    sizes = {len(share) for share in shares}
    assert max(sizes) - min(sizes) <= 1
    if of <= len(own):
        assert sum(map(len, shares)) == len(own), "nobody shares"


@needs_affinity
def test_workers_keep_to_their_share_and_the_caller_to_nothing() -> None:
    before = os.sched_getaffinity(0)
    vector = tracked_robots(2, sensors=["imu"])
    vector.reset(seed=0)
    workers = [os.sched_getaffinity(process.pid or -1) for process in vector.processes]
    assert workers == [processors(1, 2)]
    assert os.sched_getaffinity(0) == before
    vector.close()


def test_with_opengl_the_caller_steps_none() -> None:
    """It could not fork any more."""
    pytest.importorskip("moderngl")
    vector = tracked_robots(2, renderer="opengl", sensors=["imu"])
    assert len(vector.processes) == 2
    vector.close()
