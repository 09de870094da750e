"""Replay-v0 on logs of lidar and odometry: the contract, noise by the seed, the real logs."""

import warnings
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import grouser  # noqa: F401  (registers the environments)
from grouser.envs.replay import ReplayEnv
from grouser.estimators.evaluation.comparison import Run, compare_open_loop
from grouser.estimators.evaluation.summary import summarise
from grouser.estimators.registry import make as make_estimator
from grouser.geometry import between
from tests.envs.recordings.small_logs import SEEN, STEP, N, poses, write_carmen, write_ticks


def make(log: Path, **options: Any) -> gym.Env[Any, Any]:
    return gym.make("grouser/Replay-v0", log=str(log), **options)


def play(env: gym.Env[Any, Any], seed: int = 0) -> tuple[list[Any], list[Any]]:
    observation, info = env.reset(seed=seed)
    observations, infos, truncated = [observation], [info], False
    while not truncated:
        observation, _, _, truncated, info = env.step(np.zeros(2, np.float32))
        observations.append(observation)
        infos.append(info)
    return observations, infos


def reckoned(env: gym.Env[Any, Any], seed: int = 0) -> Run:
    estimator = make_estimator("dead-reckoning", env.get_wrapper_attr("rig"))
    (run,) = compare_open_loop(env, {"dead-reckoning": estimator}, lambda _: np.zeros(2), seed=seed)
    return run


@pytest.mark.parametrize("options", [{}, {"odometry_noise": 0.1}, {"render_mode": "rgb_array"}])
@pytest.mark.parametrize("write", [write_carmen, write_ticks])
def test_gymnasium_has_nothing_to_complain_of(
    tmp_path: Path, write: Any, options: dict[str, Any]
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Increments have no bounds, of which the checker likes to warn.
        warnings.filterwarnings("ignore", message=".*(minimum|maximum) value is.*infinity")
        env = make(write(tmp_path), **options).unwrapped
        check_env(env, skip_render_check=not options.get("render_mode"))


def test_every_scan_is_played_with_the_motion_that_led_to_it(tmp_path: Path) -> None:
    env = make(write_carmen(tmp_path))
    observations, infos = play(env)
    assert len(observations) == N and sorted(observations[0]) == ["lidar", "odometry", "stamp"]
    assert all(o in env.observation_space for o in observations)
    assert not observations[0]["odometry"].any()
    np.testing.assert_allclose(observations[5]["odometry"], STEP, atol=3e-6)
    truth = poses(SEEN)
    np.testing.assert_allclose([i["true_pose"] for i in infos], between(truth[0], truth), atol=1e-9)
    assert play(make(write_ticks(tmp_path)))[1][3] == {}


def test_the_seed_decides_the_noise_and_nothing_else(tmp_path: Path) -> None:
    clean, _ = play(make(write_carmen(tmp_path)))
    env = make(write_carmen(tmp_path), odometry_noise=0.1)
    (one, _), (two, _), (again, infos) = play(env, 1), play(env, 2), play(env, 1)
    for k in range(N):
        np.testing.assert_array_equal(one[k]["odometry"], again[k]["odometry"])
        np.testing.assert_array_equal(one[k]["lidar"], clean[k]["lidar"])
        assert (one[k]["odometry"] != two[k]["odometry"]).any() == (k > 0)
        assert np.abs(one[k]["odometry"] - clean[k]["odometry"]).max() < 0.1 * 5
    alone, _ = play(make(write_carmen(tmp_path), odometry_noise=0.1, sensors="odometry"), 1)
    np.testing.assert_array_equal(alone[7]["odometry"], one[7]["odometry"])
    np.testing.assert_allclose(infos[-1]["true_pose"], between(poses(SEEN)[0], poses(SEEN)[-1]))


def test_dead_reckoning_follows_the_odometry(tmp_path: Path) -> None:
    run = reckoned(make(write_carmen(tmp_path)))
    expected = between(poses(STEP)[0], poses(STEP))
    np.testing.assert_allclose([e.pose for e in run.estimates], expected, atol=2e-5)
    sigmas = [float(np.trace(e.covariance)) for e in run.estimates]
    assert sigmas[0] == 0 and (np.diff(sigmas) > 0).all()
    wheels = reckoned(make(write_ticks(tmp_path)))
    assert wheels.estimates[-1].pose[2] > 0, "the right wheel goes farther"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"sensors": ["tracks"]}, r"no sensor 'tracks'; it has: lidar, odometry \(and stamp"),
        ({"rig": {"lidar": None}}, r"leave the rig with no lidar, but the log's scans are of 180"),
        ({"rig": {"lidar.n_beams": 90}}, r"with a lidar of 90 beams, but the log's scans are of"),
        ({"odometry_noise": -0.1}, r"odometry_noise must be a share of zero or more, got -0.1"),
    ],
)
def test_what_the_log_does_not_have_is_refused(
    tmp_path: Path, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        ReplayEnv(write_carmen(tmp_path), **options)


def test_a_shorter_sight_cuts_the_scan(tmp_path: Path) -> None:
    env = make(write_carmen(tmp_path), rig={"lidar.range_max": 4.0})
    observations, _ = play(env)
    assert max(o["lidar"].max() for o in observations) == 4
    assert all(o in env.observation_space for o in observations)


def test_a_missing_or_broken_log_is_refused_when_opened(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"gone.log is missing or is not a folder of ster"):
        make(tmp_path / "gone.log")
    path = write_carmen(tmp_path)
    path.write_text(path.read_text().replace("ODOM", "ODO", 1))
    with pytest.raises(ValueError, match=r"room.log:4: 'ODO' is no message of a CARMEN log; did y"):
        make(path)


def test_the_picture_shows_the_room(tmp_path: Path) -> None:
    env = make(write_carmen(tmp_path), render_mode="rgb_array")
    env.reset()
    picture = env.render()
    assert isinstance(picture, np.ndarray) and picture.dtype == np.uint8
    assert picture.shape == (480, 480, 3)
    dark = picture[:, :, 0] == 0
    assert dark[:240].sum() > 50, "walls ahead"
    assert dark[260:].sum() == 0, "and nothing behind, where it does not look"


@pytest.mark.parametrize(
    ("name", "scans", "ate_m"),
    [("intel", 910, 24.0), ("freiburg-101", 292, 8.6), ("aces", 440, 5.4)],
)
def test_raw_odometry_of_real_logs_is_as_far_off_as_others_say(
    carmen: Path, name: str, scans: int, ate_m: float
) -> None:
    run = reckoned(make(carmen / f"{name}.log"))
    assert len(run.estimates) == scans
    assert summarise(run, name)["ate_m"] == pytest.approx(ate_m, abs=0.05)
