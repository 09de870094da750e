"""A tour goes through the goals, and back, for as long as there are steps."""

import gymnasium as gym
import numpy as np
import pytest

import grouser  # noqa: F401  (registers the environments)
from grouser.scripts import compare_tour
from grouser.scripts.compare_tour import tour

STEPS = 3000


def test_it_goes_back_and_forth_through_all_goals() -> None:
    env = gym.make("grouser/TrackedRobot-v0", world="depot", sensors=(), dynamics="fast")
    drive = tour(env, 3, STEPS)
    _, info = env.reset(seed=3)
    way = [info["true_pose"][:2]]
    for step in range(STEPS):
        action = drive(step)
        assert action is not None
        *_, info = env.step(action.astype(np.float32))
        way.append(info["true_pose"][:2])
    x, y, heading = info["start_pose"]
    c, s = np.cos(heading), np.sin(heading)
    goals = (env.get_wrapper_attr("world").goals - [x, y]) @ np.array([[c, -s], [s, c]])
    near = np.linalg.norm(np.array(way)[:, None] - goals, axis=-1) < 0.5
    assert near.any(axis=0).all()
    done = int(near.argmax(axis=0).max())
    again = near[done + 50 :].any(axis=0)
    assert again.sum() >= 3, "it went on, the way that it had come"
    assert drive(STEPS) is None


def test_a_way_that_ends_where_the_robot_is_ends_the_tour(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compare_tour, "plan_tour", lambda world: world.start[None, :2])
    env = gym.make("grouser/TrackedRobot-v0", world="room", sensors=(), dynamics="fast")
    assert tour(env, 3, STEPS)(0) is None
    env.close()
