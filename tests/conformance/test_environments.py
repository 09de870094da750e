"""Every registered environment keeps the contract of seeds and specs, and every robot's environment
that of observations and rigs."""

import hashlib
import json
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import grouser
from grouser.envs.recordings.kitti import write_kitti_recording
from grouser.estimators import EstimatedPose
from grouser.estimators.base import OBSERVATION_KEYS, TRUTH_KEYS
from grouser.estimators.synthetic_drive import synthetic_drive
from grouser.geometry import inverse_transform, lift
from grouser.rig import Rig

IDS = sorted(name for name in gym.registry if name.startswith(f"{grouser.__name__}/"))
FRAMES = 12

# What gym.make is given, several times where an environment shows different keys, and an estimator
# that reads them. A recording has its `log` besides.
MADE: dict[str, list[tuple[dict[str, Any], str]]] = {
    "grouser/TrackedRobot-v0": [({}, "one-point-ransac")],
    "grouser/Replay-v0": [({}, "one-point-ransac")],
    "grouser/LineWorld-v0": [
        ({"motion": "tracks", "sensors": ["tracks", "lines", "lidar", "points"]}, "dead-reckoning"),
        ({"world": "yan-over-range", "sensors": ["steering", "lines"]}, "ekf-line-slam"),
    ],
}
# Tasks on top of them: they show what a policy sees, and have an estimator of their own.
TASKS: dict[str, list[dict[str, Any]]] = {
    "grouser/GoalNav-v0": [
        {},
        {
            "estimator": "one-point-ransac",
            "policy_sensors": ["lidar", "left"],
            "covariance": True,
            "stop": "agent",
            "robot": {"dynamics": "fast", "image_size": [160, 120]},
        },
    ],
}

# Key: shape (None: any length) and type, as in the design's table.
CONTRACT: dict[str, tuple[tuple[int | None, ...], type[np.generic]]] = {
    "left": ((None, None, 1), np.uint8),
    "right": ((None, None, 1), np.uint8),
    "tracks": ((2,), np.float64),
    "lidar": ((None,), np.float32),
    "imu": ((6,), np.float64),
    "gps": ((2,), np.float64),
    "steering": ((2,), np.float64),
    "odometry": ((3,), np.float64),
    "lines": ((None, 4), np.float64),
    "points": ((None, 2), np.float64),
    "stamp": ((1,), np.float64),
}


@pytest.fixture(scope="session")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording in KITTI's format, for the environment that replays one."""
    folder = tmp_path_factory.mktemp("conformance") / "log"
    drive = synthetic_drive(frames=FRAMES, blackout=range(0))
    images = [(shown["left"][..., 0], shown["right"][..., 0]) for shown in drive.observations]
    left, right = zip(*images, strict=True)
    assert drive.rig.stereo is not None
    mount = drive.rig.stereo.T_base_camera
    camera_poses = inverse_transform(mount) @ lift(drive.poses) @ mount
    write_kitti_recording(folder, drive.rig, list(left), list(right), poses=camera_poses)
    return folder


ROBOTS = [(name, options, estimator) for name in MADE for options, estimator in MADE[name]]
EVERY = [
    *((name, options) for name, options, _ in ROBOTS),
    *((name, options) for name in TASKS for options in TASKS[name]),
]


def named(cases: list[Any]) -> list[str]:
    return [f"{case[0]}{index}" for index, case in enumerate(cases)]


def made(name: str, options: dict[str, Any], log: Path) -> dict[str, Any]:
    """What gym.make needs for an environment."""
    needed: dict[str, dict[str, Any]] = {"grouser/Replay-v0": {"log": str(log)}}
    return {"id": name, **options, **needed.get(name, {})}


@pytest.fixture(params=EVERY, ids=named(EVERY))
def arguments(request: pytest.FixtureRequest, log: Path) -> dict[str, Any]:
    """What gym.make needs for any environment."""
    name, options = request.param
    return made(name, options, log)


@pytest.fixture(params=ROBOTS, ids=named(ROBOTS))
def robot(request: pytest.FixtureRequest, log: Path) -> dict[str, Any]:
    """What gym.make needs for an environment that shows a robot's sensors."""
    name, options, _ = request.param
    return made(name, options, log)


@pytest.fixture
def estimator(request: pytest.FixtureRequest, robot: dict[str, Any]) -> str:
    """One that goes with these arguments."""
    _, _, name = request.node.callspec.params["robot"]
    return str(name)


def rollout(env: gym.Env[Any, Any], *, seed: int, steps: int = 6) -> list[dict[str, Any]]:
    """Observations under actions that depend on nothing."""
    shown = [env.reset(seed=seed)[0]]
    for index in range(steps):
        action = np.full(env.action_space.shape or (), -1.0, dtype=np.float32)  # a third: go on
        action[:2] = 0.9, 0.9 - 0.2 * index
        shown.append(env.step(action)[0])
    return shown


def digest(observations: list[dict[str, Any]]) -> str:
    """A hash of every bit shown."""
    total = hashlib.sha256()
    for shown in observations:
        for key in sorted(shown):
            total.update(key.encode() + np.ascontiguousarray(shown[key]).tobytes())
    return total.hexdigest()


def test_every_environment_is_found() -> None:
    assert set(IDS) == set(MADE) | set(TASKS)


@pytest.mark.filterwarnings("error")
def test_gymnasiums_checker_passes_without_a_warning(arguments: dict[str, Any]) -> None:
    check_env(gym.make(**arguments).unwrapped)


# A covariance is a matrix and lines are rows, whatever a policy's default feature extractor would
# like.
_MATRICES = "ignore:Your observation (pose_covariance|lines|points) has an unconventional shape"


def check_with_stable_baselines3(env: gym.Env[Any, Any]) -> None:
    checker = pytest.importorskip(
        "stable_baselines3.common.env_checker",
        reason="Stable-Baselines3 is not installed: pip install -e '.[rl]'",
    )
    checker.check_env(env)  # its render check would close the environment first
    env.close()


@pytest.mark.filterwarnings(_MATRICES)
@pytest.mark.filterwarnings("error")
def test_stable_baselines3s_checker_passes_without_a_warning(arguments: dict[str, Any]) -> None:
    check_with_stable_baselines3(gym.make(**arguments).unwrapped)


@pytest.mark.filterwarnings(_MATRICES)
@pytest.mark.filterwarnings("error")
def test_with_an_estimator_stable_baselines3s_checker_passes_too(
    robot: dict[str, Any], estimator: str
) -> None:
    check_with_stable_baselines3(EstimatedPose(gym.make(**robot).unwrapped, estimator))


def test_observations_have_the_keys_shapes_and_types_of_the_contract(
    robot: dict[str, Any],
) -> None:
    env = gym.make(**robot)
    for shown in rollout(env, seed=0):
        stamps = {f"{key}_stamp" for key in shown}
        assert set(shown) - stamps <= OBSERVATION_KEYS and "stamp" in shown
        assert shown in env.observation_space
        for key, value in shown.items():
            shape, kind = CONTRACT["stamp" if key in stamps else key]
            assert value.dtype == kind, key
            assert value.ndim == len(shape), key
            assert all(want in (None, got) for got, want in zip(value.shape, shape, strict=True))
    env.close()


def test_stamps_advance_by_the_rigs_step_from_zero(robot: dict[str, Any]) -> None:
    env = gym.make(**robot)
    stamps = [float(shown["stamp"][0]) for shown in rollout(env, seed=0)]
    assert stamps[0] == 0.0
    assert np.diff(stamps) == pytest.approx(env.get_wrapper_attr("rig").dt, abs=1e-9)
    env.close()


def test_the_rig_describes_what_is_shown(robot: dict[str, Any]) -> None:
    env = gym.make(**robot)
    rig = env.get_wrapper_attr("rig")
    assert isinstance(rig, Rig) and pickle.loads(pickle.dumps(rig)) == rig
    shown, _ = env.reset(seed=0)
    if "left" in shown:
        assert rig.stereo is not None
        assert shown["left"].shape[:2] == (rig.stereo.height, rig.stereo.width)
    if "lidar" in shown:
        assert rig.lidar is not None
        assert shown["lidar"].shape == (rig.lidar.n_beams,)
        assert shown["lidar"].max() <= rig.lidar.range_max
    assert ("tracks" in shown) <= (rig.tracks is not None)
    assert ("imu" in shown) <= (rig.imu is not None)
    assert ("steering" in shown) <= (rig.steering is not None)
    assert ("odometry" in shown) <= (rig.odometry is not None)
    if "lines" in shown:
        assert rig.line_sensor is not None
        assert shown["lines"].shape == (rig.line_sensor.max_lines, 4)
    env.close()


def test_the_truth_is_told_in_info_from_pose_zero_on(robot: dict[str, Any]) -> None:
    env = gym.make(**robot)
    shown, info = env.reset(seed=0)
    assert not TRUTH_KEYS & set(shown)
    assert info["true_pose"].shape == (3,) and np.abs(info["true_pose"]).max() < 1e-9
    for _ in range(4):
        _, _, _, _, info = env.step(np.ones(2, dtype=np.float32))
        T = info["true_pose_3d"]
        assert np.abs(T[:3, :3] @ T[:3, :3].T - np.eye(3)).max() < 1e-6
        assert np.abs(T[:2, 3] - info["true_pose"][:2]).max() < 1e-6
    env.close()


def test_successive_observations_share_no_memory(arguments: dict[str, Any]) -> None:
    env = gym.make(**arguments)
    observations = rollout(env, seed=0, steps=3) + rollout(env, seed=0, steps=1)
    for earlier, later in zip(observations, observations[1:], strict=False):
        for a in earlier.values():
            assert not any(np.may_share_memory(a, b) for b in later.values())
    env.close()


def test_a_seed_fixes_every_bit_in_this_process(arguments: dict[str, Any]) -> None:
    env = gym.make(**arguments)
    first = digest(rollout(env, seed=0))
    rollout(env, seed=1)
    assert digest(rollout(env, seed=0)) == first
    twin = gym.make(**arguments)
    assert digest(rollout(twin, seed=0)) == first
    env.close()
    twin.close()


@pytest.mark.parametrize("name", ["grouser/TrackedRobot-v0", "grouser/LineWorld-v0"])
def test_another_seed_shows_another_world_or_other_noise(name: str) -> None:
    env = gym.make(name)
    assert digest(rollout(env, seed=0, steps=1)) != digest(rollout(env, seed=1, steps=1))
    env.close()


PROCESS = """
import json, sys
sys.path.insert(0, sys.argv[1])
from test_environments import digest, gym, rollout
print(digest(rollout(gym.make(**json.loads(sys.argv[2])), seed=0)))
"""


def test_a_seed_fixes_every_bit_in_another_process(arguments: dict[str, Any]) -> None:
    env = gym.make(**arguments)
    here = digest(rollout(env, seed=0))
    env.close()
    folder = str(Path(__file__).parent)
    command = [sys.executable, "-c", PROCESS, folder, json.dumps(arguments)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[-1] == here


def test_alone_or_in_a_vector_it_shows_the_same_bits(arguments: dict[str, Any]) -> None:
    options = {key: value for key, value in arguments.items() if key != "id"}
    several = gym.make_vec(arguments["id"], 2, vectorization_mode="sync", **options)
    shown, _ = several.reset(seed=[5, 6])  # type: ignore[arg-type]  # one a member
    for index, seed in enumerate((5, 6)):
        env = gym.make(**arguments)
        alone, _ = env.reset(seed=seed)
        assert digest([{key: value[index] for key, value in shown.items()}]) == digest([alone])
        env.close()
    several.close()


def test_the_spec_survives_json_and_rebuilds_the_environment(arguments: dict[str, Any]) -> None:
    env = gym.make(**arguments)
    assert env.spec is not None
    twin = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert digest(rollout(env, seed=3, steps=2)) == digest(rollout(twin, seed=3, steps=2))
    env.close()
    twin.close()


def test_with_an_estimator_the_spec_survives_json_too(
    robot: dict[str, Any], estimator: str
) -> None:
    env = EstimatedPose(gym.make(**robot), estimator)
    assert env.spec is not None
    twin = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert digest(rollout(env, seed=3)) == digest(rollout(twin, seed=3))
    assert "pose" in rollout(twin, seed=0, steps=1)[1]
    env.close()
    twin.close()


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version")  # it is a wrapper
@pytest.mark.filterwarnings("error")
def test_with_an_estimator_gymnasiums_checker_passes_too(
    robot: dict[str, Any], estimator: str
) -> None:
    check_env(EstimatedPose(gym.make(**robot), estimator))


class Mute(gym.Wrapper[Any, Any, Any, Any]):
    """Replaces all that info says by garbage."""

    def reset(self, **options: Any) -> tuple[Any, dict[str, Any]]:
        return self.env.reset(**options)[0], {"true_pose": "nowhere"}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        return (*self.env.step(action)[:4], {"true_pose": np.full(3, np.nan)})


def test_what_info_says_changes_neither_observation_nor_estimate(
    robot: dict[str, Any], estimator: str
) -> None:
    honest = EstimatedPose(gym.make(**robot), estimator)
    garbled = EstimatedPose(Mute(gym.make(**robot)), estimator)
    assert digest(rollout(honest, seed=0)) == digest(rollout(garbled, seed=0))
    honest.close()
    garbled.close()
