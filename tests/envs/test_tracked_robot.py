"""`grouser/TrackedRobot-v0` keeps the contracts of Gymnasium, of DESIGN section 3 and its own."""

import json
import multiprocessing
import subprocess
import sys
import warnings
from collections.abc import Iterator
from hashlib import sha256
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import TimeLimit

import grouser  # noqa: F401 - registers the environments
from grouser.envs.sensors.suite import DEFAULT_SENSORS
from grouser.envs.simulation.renderers.rasteriser import Rasteriser
from grouser.envs.simulation.worlds.registry import world_names
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.geometry import compose, exp, project

SMALL = (64, 48)
Observation = dict[str, Any]


@pytest.fixture
def env() -> Iterator[TrackedRobotEnv]:
    env = TrackedRobotEnv(image_size=SMALL)
    yield env
    env.close()


def actions(n: int, seed: int = 0) -> np.ndarray[Any, np.dtype[np.float32]]:
    return np.random.default_rng(seed).uniform(-1, 1, (n, 2)).astype(np.float32)


def rollout(env: TrackedRobotEnv, *, seed: int | None, n: int = 4) -> list[Observation]:
    observations = [env.reset(seed=seed)[0]]
    return observations + [env.step(action)[0] for action in actions(n)]


def digest(observations: list[Observation]) -> str:
    total = sha256()
    for observation in observations:
        for key in sorted(observation):
            total.update(observation[key].tobytes())
    return total.hexdigest()


# --- contracts of others -------------------------------------------------------------------------


@pytest.mark.parametrize("color", [False, True])
def test_gymnasium_finds_nothing_to_complain_about(color: bool) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = gym.make(
            "grouser/TrackedRobot-v0", image_size=SMALL, color=color, render_mode="rgb_array"
        )
        check_env(made.unwrapped)
        made.close()


def test_stable_baselines3_finds_nothing_to_complain_about(env: TrackedRobotEnv) -> None:
    reason = 'the extra is not installed: pip install "grouser[rl]"'
    pytest.importorskip("torch", reason=reason)
    pytest.importorskip("stable_baselines3", reason=reason)
    from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env_for_sb3(env)


def test_an_environment_is_rebuilt_from_its_spec() -> None:
    options: dict[str, Any] = {
        "sensors": ["tracks", "imu"],
        "image_size": [80, 60],
        "effects": {"tracks.noise": 0.02},
    }
    made = gym.make("grouser/TrackedRobot-v0", **options)
    assert made.spec is not None
    again = gym.make(gym.envs.registration.EnvSpec.from_json(made.spec.to_json()))
    assert again.observation_space == made.observation_space
    assert json.loads(made.spec.to_json())["kwargs"] == options
    one, other = made.reset(seed=5)[0], again.reset(seed=5)[0]
    assert np.array_equal(one["imu"], other["imu"])
    made.close()
    again.close()


def test_the_user_sets_the_length_of_an_episode() -> None:
    env = TimeLimit(TrackedRobotEnv(sensors=("tracks",)), max_episode_steps=2)
    env.reset(seed=0)
    assert env.step(actions(1)[0])[1:4] == (0.0, False, False)
    assert env.step(actions(1)[0])[1:4] == (0.0, False, True)
    env.close()


# --- observation and info ------------------------------------------------------------------------


def test_observations_are_as_the_design_says(env: TrackedRobotEnv) -> None:
    observation, _ = env.reset(seed=1)
    expected = {
        "left": ((48, 64, 1), np.uint8),
        "right": ((48, 64, 1), np.uint8),
        "tracks": ((2,), np.float64),
        "lidar": ((360,), np.float32),
        "imu": ((6,), np.float64),
        "stamp": ((1,), np.float64),
    }
    found = {key: (value.shape, value.dtype.type) for key, value in observation.items()}
    assert found == expected
    for k, action in enumerate(actions(10)):
        observation = env.step(action)[0]
        assert env.observation_space.contains(observation)
        assert observation["stamp"][0] == pytest.approx(0.1 * (k + 1))


@pytest.mark.parametrize(
    "sensors", [("left",), ("right", "lidar"), ("tracks",), ("imu", "stamp"), ()]
)
def test_an_observation_holds_what_was_asked_for(sensors: tuple[str, ...]) -> None:
    env = TrackedRobotEnv(sensors=sensors, image_size=SMALL)
    observation, _ = env.reset(seed=1)
    assert set(observation) == {*sensors, "stamp"} == set(env.observation_space.spaces)
    env.close()


def test_leaving_a_sensor_out_changes_no_bit_of_the_others() -> None:
    everything = rollout(full := TrackedRobotEnv(image_size=SMALL), seed=3)
    full.close()
    for sensors in (("left",), ("right", "imu"), ("lidar",), ("tracks",)):
        env = TrackedRobotEnv(sensors=sensors, image_size=SMALL)
        for some, all_of in zip(rollout(env, seed=3), everything, strict=True):
            assert all(np.array_equal(some[key], all_of[key]) for key in sensors)
        env.close()


def test_an_eye_that_is_not_asked_for_is_not_rendered(monkeypatch: pytest.MonkeyPatch) -> None:
    rendered: list[int] = []
    render = Rasteriser.render

    def counting(self: Rasteriser, T: Any) -> Any:
        rendered.append(id(self))
        return render(self, T)

    monkeypatch.setattr(Rasteriser, "render", counting)
    for sensors, pictures in ((("tracks", "lidar"), 0), (("left",), 3), (("left", "right"), 6)):
        rendered.clear()
        env = TrackedRobotEnv(sensors=sensors, image_size=SMALL)
        rollout(env, seed=0, n=2)
        assert len(rendered) == pictures
        env.close()


def test_observations_and_infos_are_new_memory(env: TrackedRobotEnv) -> None:
    seen = [env.reset(seed=0)] + [env.step(action)[::4] for action in actions(3)]
    for (one, one_info), (other, other_info) in zip(seen, seen[1:], strict=False):
        assert not any(np.may_share_memory(one[key], other[key]) for key in one)
        for key, value in one_info.items():
            if isinstance(value, np.ndarray):
                assert not np.may_share_memory(value, other_info[key])


def test_the_truth_begins_at_zero_and_is_consistent(env: TrackedRobotEnv) -> None:
    _, info = env.reset(seed=2)
    np.testing.assert_allclose(info["true_pose"], 0, atol=1e-12)
    np.testing.assert_allclose(info["true_pose_3d"], np.eye(4), atol=1e-12)
    before, start = info["true_pose"], info["start_pose"]
    for _ in range(15):
        _, _, _, _, info = env.step(np.array([0.9, 0.4], dtype=np.float32))
        step = info["true_twist"] * 0.1
        midway = np.array([before[0], before[1], before[2] + step[2] / 2])
        moved = compose(midway, [step[0], step[1], step[2] / 2])
        np.testing.assert_allclose(info["true_pose"], moved, atol=1e-4)
        np.testing.assert_allclose(project(info["true_pose_3d"]), info["true_pose"], atol=1e-12)
        assert np.array_equal(info["start_pose"], start)
        before = info["true_pose"]
    left, right, _ = info["icr"]
    assert env.rig.tracks is not None
    assert left - right == pytest.approx(env.rig.tracks.effective_width, rel=0.05)
    assert info["slip"][0] > 0 > info["slip"][1]  # the outer track spins, the inner one is dragged
    assert info["contacts"] == 0 and info["collision"] is False


@pytest.mark.parametrize("world", world_names())
def test_centres_of_rotation_give_back_the_motion_in_every_world(world: str) -> None:
    """As docs/simulation.md says: where the tracks turn the robot, on slopes too."""
    env = TrackedRobotEnv(world=world, difficulty=0.7, sensors=(), dynamics="fast")
    _, info = env.reset(seed=1)
    turning = 0
    for action in np.repeat(actions(6, seed=2), 10, axis=0):
        before = info["true_pose"]
        *_, info = env.step(action)
        twist, (u_left, u_right) = info["true_twist"], info["track_speed"]
        y_left, y_right, x = info["icr"]
        if abs(y_left - y_right) > 1e-3:  # not NaN
            turning += 1
            w = (u_right - u_left) / (y_left - y_right)
            np.testing.assert_allclose([u_left + w * y_left, -x * w, w], twist, atol=1e-9)
        # At 20 degrees of slope a step of 5 cm is 3 mm shorter from above.
        np.testing.assert_allclose(compose(before, exp(0.1 * twist)), info["true_pose"], atol=3e-3)
    assert turning > 40
    env.close()


def test_slip_makes_track_increments_differ_from_the_motion(env: TrackedRobotEnv) -> None:
    env.reset(seed=2)
    turned, expected = 0.0, 0.0
    for _ in range(30):
        observation, _, _, _, info = env.step(np.array([-0.6, 0.6], dtype=np.float32))
        assert env.rig.tracks is not None
        expected += float(np.diff(observation["tracks"])[0]) / env.rig.tracks.gauge
        turned = turned + info["true_twist"][2] * 0.1
    assert 0.6 < turned / expected < 0.8


def test_the_encoders_read_full_speed() -> None:
    env = TrackedRobotEnv(sensors=("tracks",), effects={"tracks.noise": 0.0})
    env.reset(seed=2)
    steps = [env.step(np.array([1.0, -1.0], dtype=np.float32)) for _ in range(12)]
    assert steps[-1][0]["tracks"] == pytest.approx(np.array([0.05, -0.05]), abs=1.1e-4)
    env.close()


def test_driving_into_a_wall_is_a_collision() -> None:
    env = TrackedRobotEnv(sensors=("tracks",))
    env.reset(seed=0)
    for _ in range(400):
        _, _, terminated, _, info = env.step(np.ones(2, dtype=np.float32))
        if info["collision"]:
            break
    assert info["collision"] and info["contacts"] > 0 and not terminated
    env.close()


# --- determinism ---------------------------------------------------------------------------------


def test_a_seed_means_the_same_bits(env: TrackedRobotEnv) -> None:
    first, other, again = (digest(rollout(env, seed=seed)) for seed in (0, 1, 0))
    assert first == again != other


def test_the_same_bits_after_a_collision(env: TrackedRobotEnv) -> None:
    """Bullet keeps no memory of what it was before a reset."""
    first = digest(rollout(env, seed=0))
    env.reset(seed=4)
    collided = False
    for _ in range(300):
        collided = env.step(np.ones(2, dtype=np.float32))[4]["collision"] or collided
    assert collided
    assert digest(rollout(env, seed=0)) == first


def test_reset_without_a_seed_goes_on_to_another_world(env: TrackedRobotEnv) -> None:
    first = [digest(rollout(env, seed=seed)) for seed in (6, None, None)]
    second = [digest(rollout(env, seed=seed)) for seed in (6, None, None)]
    assert first == second and len(set(first)) == 3


_HASH_SCRIPT = """
import sys
sys.path.insert(0, {tests!r})
from grouser.envs.simulation.worlds.registry import world_names
from grouser.envs.tracked_robot import TrackedRobotEnv
from tests.envs.test_tracked_robot import digest, rollout
print(digest(rollout(TrackedRobotEnv(), seed=11, n=8)))
"""


def test_two_processes_give_the_same_bits(pytestconfig: pytest.Config) -> None:
    """Full-size images, lidar, everything; each process loads its own kernels."""
    script = _HASH_SCRIPT.format(tests=str(pytestconfig.rootpath))
    runs = [
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    hashes = [run.stdout.split()[-1] for run in runs]
    env = TrackedRobotEnv()
    assert hashes == [digest(rollout(env, seed=11, n=8))] * 2
    env.close()


def _step_and_send(env: TrackedRobotEnv, connection: Any) -> None:
    connection.send(digest([env.step(action)[0] for action in actions(3, seed=1)]))


def test_a_forked_child_goes_on_with_the_same_bits(env: TrackedRobotEnv) -> None:
    """The child inherits the environment but not the thread that renders the second eye."""
    rollout(env, seed=0)
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=_step_and_send, args=(env, sender))
    child.start()
    assert receiver.poll(60), "the child hangs"
    theirs = receiver.recv()
    child.join(60)
    assert child.exitcode == 0
    assert theirs == digest([env.step(action)[0] for action in actions(3, seed=1)])


def test_two_environments_at_once_do_not_meddle(env: TrackedRobotEnv) -> None:
    alone = digest(rollout(env, seed=0))
    other = TrackedRobotEnv(image_size=SMALL)
    other.reset(seed=9)
    observations = [env.reset(seed=0)[0]]
    for action in actions(4):
        other.step(-action)
        observations.append(env.step(action)[0])
    other.close()
    assert digest(observations) == alone


# --- rendering -----------------------------------------------------------------------------------


def test_a_chase_view_shows_the_robot_and_follows_it() -> None:
    env = TrackedRobotEnv(sensors=(), render_mode="rgb_array")
    env.reset(seed=0)
    first = env.render()
    assert first is not None
    assert first.shape == (480, 640, 3) and first.dtype == np.uint8 and first.std() > 20
    for _ in range(5):
        env.step(np.ones(2, dtype=np.float32))
    second = env.render()
    assert second is not None
    changed = np.any(first != second, axis=-1)
    robot = np.s_[230:330, 270:370]  # the middle of the picture moves with the camera
    assert changed[robot].mean() < 0.6 < changed[380:].mean()
    env.close()


def test_without_a_render_mode_nothing_is_rendered(env: TrackedRobotEnv) -> None:
    env.reset(seed=0)
    assert env.render() is None


def test_a_window_opens_and_closes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame = pytest.importorskip(
        "pygame", reason='the extra is not installed: pip install "grouser[view]"'
    )
    env = TrackedRobotEnv(sensors=(), render_mode="human")
    env.reset(seed=0)
    env.step(actions(1)[0])
    shown = pygame.surfarray.array3d(pygame.display.get_surface())
    assert shown.shape == (640, 480, 3) and shown.std() > 20
    env.close()
    assert not pygame.display.get_init()
    env.close()


# --- defaults ------------------------------------------------------------------------------------


def test_seed_zero_is_a_seed(env: TrackedRobotEnv) -> None:
    env.reset(seed=0)
    assert env.np_random_seed == 0


def test_every_sensor_has_a_name(env: TrackedRobotEnv) -> None:
    assert {*DEFAULT_SENSORS, "stamp"} == set(env.observation_space.spaces)
