"""What `grouser/TrackedRobot-v0` refuses, in which words, and how it ends."""

import sys
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pybullet
import pytest
from gymnasium.error import ClosedEnvironmentError, ResetNeeded

from grouser.envs import tracked_robot
from grouser.envs.simulation.bullet_dynamics import BulletDynamics
from grouser.envs.simulation.renderers import gl_context
from grouser.envs.tracked_robot import TrackedRobotEnv

SMALL = (64, 48)


@pytest.fixture
def env() -> Iterator[TrackedRobotEnv]:
    env = TrackedRobotEnv(image_size=SMALL)
    yield env
    env.close()


def test_a_window_without_pygame_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(ImportError, match=r'needs pygame.*pip install "grouser\[view\]"'):
        TrackedRobotEnv(render_mode="human")


def test_what_opengl_lacks_is_said_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "moderngl", None)
        with pytest.raises(ImportError, match=r'needs moderngl: pip install "grouser\[opengl\]"'):
            TrackedRobotEnv(renderer="opengl")
    pytest.importorskip(
        "moderngl", reason='the extra is not installed: pip install "grouser[opengl]"'
    )
    monkeypatch.setitem(gl_context.LIBRARIES, "libGL.so.none", "libgl-none")
    words = "needs the system library libGL.so.none.*|needs the system library libEGL"
    with pytest.raises(RuntimeError, match=words):
        TrackedRobotEnv(renderer="opengl")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"world": "yrad"}, r"no world is named 'yrad'; did you mean 'yard'\? known: .*yard"),
        ({"sensors": ("sonar",)}, "no sensor is named 'sonar'; known: left, right, tracks, lidar"),
        ({"sensors": "sonar"}, "no sensor is named 'sonar'"),
        ({"render_mode": "ansi"}, "no render mode is named 'ansi'; known: None, human, rgb_array"),
        ({"image_size": (320,)}, r"image_size must be width and height.*got \(320,\)"),
        ({"image_size": (4, 4)}, "whole numbers from 16 to 4096"),
        ({"image_size": 320}, "image_size must be width and height.*got 320"),
        ({"difficulty": 1.5}, r"difficulty must be in \[0, 1\].*got 1.5"),
        ({"terrain": "lava"}, "no terrain is named 'lava'; known: .*gravel"),
        ({"randomize": ("colour",)}, "nothing named 'colour' can be randomised; .*known: texture"),
        ({"dynamics": "havok"}, "no dynamics are named 'havok'; known: bullet, fast"),
        ({"renderer": "vulkan"}, "no renderer is named 'vulkan'; known: raster, opengl"),
        ({"effects": {"stereo.noise": 1.0}}, "no effect is named 'stereo.noise'; did you mean"),
        ({"effects": {"tracks.noise": -1.0}}, "tracks.noise .* must be a number from 0 to"),
        ({"faults": [{"what": "gps.outage", "start": 5, "end": 2}]}, "must end after it starts"),
        ({"timing": {"lidar.rate": 3.0}}, "lidar.rate"),
        ({"sensors": None}, "sensors must be names of: left, right.*got None"),
        ({"effects": ["stereo.glare"]}, r"effects must be amounts by name, such as \{"),
        ({"faults": {"what": "gps.outage"}}, r"faults must be a list, such as \[\{'what'"),
        ({"faults": None}, r"faults must be a list, .*got None"),
        ({"timing": ["lidar.rate"]}, r"timing must be numbers by name, such as \{"),
    ],
)
def test_bad_options_are_refused(
    options: dict[str, Any], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before anything slow is announced, or a window opens."""
    announced: list[str] = []
    monkeypatch.setattr(tracked_robot, "announce", lambda: announced.append("kernels"))
    with pytest.raises(ValueError, match=words):
        TrackedRobotEnv(**options)
    assert not announced


@pytest.mark.parametrize("action", [np.zeros(3), np.array([np.nan, 0.0]), np.zeros((1, 2))])
def test_a_malformed_action_is_refused(env: TrackedRobotEnv, action: Any) -> None:
    env.reset(seed=0)
    with pytest.raises(ValueError, match="an action is two finite numbers"):
        env.step(action)


def test_a_speed_beyond_the_motors_is_clipped(env: TrackedRobotEnv) -> None:
    poses = []
    for fraction in (1.0, 5.0):
        env.reset(seed=0)
        poses.append(env.step(np.array([fraction, fraction], dtype=np.float32))[4]["true_pose"])
    assert np.array_equal(*poses)


def test_reset_takes_no_options(env: TrackedRobotEnv) -> None:
    with pytest.raises(ValueError, match=r"reset takes no options, got \['start'\]"):
        env.reset(seed=0, options={"start": 1})


def test_the_order_of_calls_is_checked(env: TrackedRobotEnv) -> None:
    with pytest.raises(ResetNeeded, match="call reset\\(\\) before step"):
        env.step(np.zeros(2, dtype=np.float32))
    env.close()
    for call in (env.reset, lambda: env.step(np.zeros(2, dtype=np.float32)), env.render):
        with pytest.raises(ClosedEnvironmentError, match="was closed; make a new one"):
            call()


def test_close_frees_everything_and_may_be_called_twice() -> None:
    env = TrackedRobotEnv(image_size=SMALL)
    env.reset(seed=0)
    dynamics = env._robot._dynamics
    assert isinstance(dynamics, BulletDynamics)
    client = dynamics.bullet.client
    assert pybullet.isConnected(client)
    assert any(thread.name.startswith("grouser") for thread in threading.enumerate())
    env.close()
    assert not pybullet.isConnected(client)
    assert not any(thread.name.startswith("grouser") for thread in threading.enumerate())
    env.close()
