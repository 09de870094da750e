"""Replay-v0 keeps the contracts of an environment and moves the truth from camera to robot."""

import warnings
from math import radians
from pathlib import Path
from shutil import copytree
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

import grouser  # noqa: F401  (registers the environments)
from grouser.envs.recordings.kitti import write_kitti_recording
from grouser.envs.replay import ReplayEnv
from grouser.geometry import Array, compose, lift, project
from grouser.rig import Rig, StereoCamera, camera_mount

N, WIDTH, HEIGHT = 30, 48, 40
MOUNT = camera_mount(0.4, 0.1, 0.5, pitch=radians(12), yaw=radians(3))


def robot_poses() -> Array:
    """(N, 3) of a robot that turns as it drives."""
    poses = [np.zeros(3)]
    for _ in range(N - 1):
        poses.append(compose(poses[-1], [0.1, 0.0, 0.05]))
    return np.array(poses)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a camera that sits on a robot as MOUNT says."""
    folder = tmp_path_factory.mktemp("replay") / "log"
    rng = np.random.default_rng(0)
    stereo = StereoCamera(50.0, 50.0, 23.5, 19.5, 0.12, WIDTH, HEIGHT, T_base_camera=MOUNT)
    left, right = rng.integers(0, 256, (2, N, HEIGHT, WIDTH), dtype=np.uint8)
    camera_poses = np.linalg.inv(MOUNT) @ lift(robot_poses()) @ MOUNT
    rig = Rig(dt=0.1, stereo=stereo)
    write_kitti_recording(folder, rig, list(left), list(right), poses=camera_poses)
    return folder


def make(log: Path, **options: Any) -> gym.Env[Any, Any]:
    return gym.make("grouser/Replay-v0", log=str(log), **options)


def play(env: gym.Env[Any, Any]) -> tuple[list[Any], list[Any]]:
    observation, info = env.reset(seed=0)
    observations, infos, truncated = [observation], [info], False
    while not truncated:
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        assert (reward, terminated) == (0.0, False)
        observations.append(observation)
        infos.append(info)
    return observations, infos


@pytest.mark.parametrize("options", [{}, {"color": True}, {"render_mode": "rgb_array"}])
def test_gymnasium_has_nothing_to_complain_of(log: Path, options: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(log, **options).unwrapped, skip_render_check=not options.get("render_mode"))


def test_stable_baselines_has_nothing_to_complain_of(log: Path) -> None:
    pytest.importorskip("stable_baselines3", reason="needs the rl extra")
    from stable_baselines3.common.env_checker import check_env as check_sb3_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_sb3_env(make(log).unwrapped)


def test_every_frame_is_played_once_in_order(log: Path) -> None:
    observations, _ = play(make(log))
    assert len(observations) == N
    np.testing.assert_allclose([o["stamp"][0] for o in observations], 0.1 * np.arange(N))
    assert all(o in make(log).observation_space for o in observations)
    assert len({o["left"].tobytes() for o in observations}) == N


def test_the_seed_and_the_action_change_nothing(log: Path) -> None:
    env = make(log)
    first, _ = play(env)
    again, _ = env.reset(seed=99)
    np.testing.assert_array_equal(first[0]["left"], again["left"])
    still, *_ = env.step(np.zeros(2, np.float32))
    np.testing.assert_array_equal(first[1]["right"], still["right"])


def test_observations_and_infos_share_no_memory(log: Path) -> None:
    env = make(log)
    a, info_a = env.reset(seed=0)
    b, info_b = env.reset(seed=0)
    for key in a:
        assert not np.may_share_memory(a[key], b[key]), key
    for key in info_a:
        assert not np.may_share_memory(info_a[key], info_b[key]), key


def test_the_truth_is_that_of_the_robot_not_of_its_camera(log: Path) -> None:
    _, infos = play(make(log, rig={"stereo.T_base_camera": MOUNT.tolist()}))
    np.testing.assert_allclose([i["true_pose"] for i in infos], robot_poses(), atol=1e-9)
    np.testing.assert_allclose([i["true_pose_3d"] for i in infos], lift(robot_poses()), atol=1e-9)


def test_without_the_mount_the_truth_is_that_of_a_level_camera(log: Path) -> None:
    """The wrong mount shows: the lever arm makes another course of it."""
    _, infos = play(make(log))
    away = np.linalg.norm([i["true_pose"][:2] for i in infos] - robot_poses()[:, :2], axis=1)
    assert away[0] == 0
    assert away.max() > 0.1


def test_without_poses_there_is_no_truth(log: Path, tmp_path: Path) -> None:
    bare = Path(copytree(log, tmp_path / "bare"))
    (bare / "poses.txt").unlink()
    env = make(bare)
    assert not env.get_wrapper_attr("has_truth")
    assert env.reset()[1] == {}


def test_stepping_beyond_the_end_or_before_the_start_is_refused(log: Path) -> None:
    env = make(log).unwrapped
    with pytest.raises(ResetNeeded, match=r"the replay has not begun; call reset\(\)"):
        env.step(np.zeros(2, np.float32))
    play(env)
    with pytest.raises(ResetNeeded, match=r"the recording has ended: frame 29 was its last of 30"):
        env.step(np.zeros(2, np.float32))
    env.reset()
    env.step(np.zeros(2, np.float32))


def test_only_the_sensors_asked_for_are_observed(log: Path) -> None:
    observation, _ = make(log, sensors=("left",)).reset()
    assert sorted(observation) == ["left", "stamp"]
    observation, _ = make(log, sensors=()).reset()
    assert sorted(observation) == ["stamp"]


def test_a_sensor_that_is_not_there_is_refused(log: Path) -> None:
    with pytest.raises(ValueError, match=r"no sensor 'lidar', 'tracks'; it has: left, right"):
        make(log, sensors=("left", "tracks", "lidar"))


def test_one_sensor_may_be_asked_for_by_its_name_alone(log: Path) -> None:
    assert sorted(make(log, sensors="right").reset()[0]) == ["right", "stamp"]


def test_a_step_that_the_recording_has_wrong_stretches_its_stamps(log: Path) -> None:
    env = make(log, rig={"dt": 0.25})
    observations, _ = play(env)
    assert env.get_wrapper_attr("rig").dt == 0.25
    np.testing.assert_allclose([o["stamp"][0] for o in observations], 0.25 * np.arange(N))
    assert all(o in env.observation_space for o in observations)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"stereo.width": 64}, r"leave the rig with 64 x 40 px, but .* of 48 x 40 px; override"),
        ({"stereo": None}, r"leave the rig with no stereo pair, but the recording's images are"),
    ],
)
def test_a_rig_that_is_not_of_these_images_is_refused(
    log: Path, overrides: dict[str, Any], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        make(log, rig=overrides)


def test_an_unknown_rig_entry_or_render_mode_is_refused(log: Path) -> None:
    with pytest.raises(ValueError, match=r"the rig has no 'stereo.focal' to override; it has"):
        make(log, rig={"stereo.focal": 1.0})
    with pytest.raises(ValueError, match=r"render_mode 'human' is not one of None, 'rgb_array'"):
        ReplayEnv(log, render_mode="human")


def test_rendering_shows_the_left_image(log: Path) -> None:
    env = make(log, render_mode="rgb_array")
    observation, _ = env.reset()
    frame = env.render()
    assert isinstance(frame, np.ndarray)
    assert frame.shape == (HEIGHT, WIDTH, 3)
    np.testing.assert_array_equal(frame[:, :, :1], observation["left"])


def test_the_spec_rebuilds_the_environment(log: Path) -> None:
    env = make(log, rig={"stereo.T_base_camera": MOUNT.tolist()}, color=True)
    assert env.spec is not None
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert again.get_wrapper_attr("rig") == env.get_wrapper_attr("rig")
    assert again.observation_space == env.observation_space


def test_kitti_06(kitti_06: Path) -> None:
    env = make(kitti_06)
    stereo = env.get_wrapper_attr("rig").stereo
    observations, infos = play(env)
    assert len(observations) == 51
    assert observations[0]["left"].shape == (370, 1226, 1)
    assert stereo.baseline == pytest.approx(0.537, abs=1e-3)
    path = np.array([i["true_pose_3d"][:3, 3] for i in infos])
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    assert length == pytest.approx(59.9, abs=0.05)
    assert infos[-1]["true_pose"][0] > 59, "forward is x of the robot, not z of the camera"
    np.testing.assert_allclose(project(infos[-1]["true_pose_3d"]), infos[-1]["true_pose"])
    np.testing.assert_allclose(infos[0]["true_pose_3d"], np.eye(4), atol=1e-12)
