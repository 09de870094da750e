"""What others build on: checkers without a word for every set of sensors, states that can be saved
and restored to the bit, vectors, and no growing memory."""

import gc
import itertools
import multiprocessing
import pickle
import subprocess
import sys
import warnings
from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pybullet
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from numpy.typing import NDArray

import grouser  # noqa: F401 - registers the environments
from grouser.envs.sensors.suite import SENSORS
from grouser.envs.simulation.bullet_dynamics import BulletDynamics
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.registry import make_renderer
from grouser.envs.simulation.worlds.registry import make_world, world_names
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.envs.tracked_robot_state import SavedGenerator
from grouser.geometry import transform
from grouser.rig import R_BASE_OPTICAL

ID = "grouser/TrackedRobot-v0"
SMALL = (64, 48)
SUBSETS = [chosen for n in range(len(SENSORS) + 1) for chosen in itertools.combinations(SENSORS, n)]
EVERYTHING: dict[str, Any] = {
    "sensors": SENSORS,
    "image_size": SMALL,
    "randomize": ["light", "friction", "sensor_noise"],
    "effects": {
        "stereo.exposure_drift": 0.1,
        "stereo.rolling_shutter": 0.02,
        "right.frozen": 0.2,
        "lidar.mixed_pixels": 0.01,
        "imu.rate_walk": 0.01,
        "gps.drift": 1.0,
    },
    "faults": [
        {"what": "stereo.darkness", "start": 0.3, "end": 0.7, "amount": 0.8},
        {"what": "left_track.power_loss", "start": 0.5, "amount": 0.5},
    ],
    "timing": {"lidar.rate": 5.0, "gps.rate": 2.0, "stereo.latency": 0.1, "tracks.latency": 0.2},
}
"""Options that use all there is to remember between two steps."""


def actions(n: int, seed: int = 0) -> NDArray[np.float32]:
    return np.random.default_rng(seed).uniform(-1, 1, (n, 2)).astype(np.float32)


def digest(observations: Iterable[dict[str, Any]]) -> str:
    total = sha256()
    for shown in observations:
        for key in sorted(shown):
            total.update(key.encode() + np.ascontiguousarray(shown[key]).tobytes())
    return total.hexdigest()


def go_on(env: TrackedRobotEnv, course: NDArray[np.float32]) -> str:
    """A hash of all observations, and of the truth."""
    taken = [env.step(action) for action in course]
    truth = [{k: np.asarray(v) for k, v in step[4].items()} for step in taken]
    return digest([step[0] for step in taken]) + digest(truth)


# --- checkers ------------------------------------------------------------------------------------


@pytest.mark.parametrize("sensors", SUBSETS, ids="-".join)
def test_checkers_pass_without_a_warning_for_every_set_of_sensors(sensors: tuple[str, ...]) -> None:
    checkers = [check_env]
    try:
        from stable_baselines3.common.env_checker import check_env as check_env_of_sb3
    except ImportError:  # an extra; .ci/run installs it
        pass
    else:
        checkers.append(check_env_of_sb3)
    for check in checkers:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            made = gym.make(ID, sensors=sensors, image_size=SMALL, dynamics="fast")
            check(made.unwrapped)
            made.close()


@pytest.mark.parametrize("world", world_names())
def test_checkers_pass_in_every_world_with_everything_on(world: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = gym.make(ID, world=world, render_mode="rgb_array", **EVERYTHING)
        check_env(made.unwrapped)
        made.close()


def test_a_spec_with_everything_survives_json() -> None:
    made = gym.make(
        ID, world="garden", dynamics="fast", difficulty=0.8, terrain="mixed", **EVERYTHING
    )
    assert made.spec is not None
    again = gym.make(EnvSpec.from_json(made.spec.to_json()))
    one, other = ([env.reset(seed=3)[0]] for env in (made, again))
    for action in actions(6):
        one.append(made.step(action)[0])
        other.append(again.step(action)[0])
    assert digest(one) == digest(other)
    made.close()
    again.close()


# --- saving and restoring ------------------------------------------------------------------------


@pytest.mark.parametrize("dynamics", ["bullet", "fast"])
@pytest.mark.parametrize("world", ["yard", "rubble"])
def test_a_restored_state_goes_on_to_the_bit(world: str, dynamics: str) -> None:
    env = TrackedRobotEnv(world=world, dynamics=dynamics, **EVERYTHING)
    env.reset(seed=4)
    go_on(env, actions(7))
    state = env.save_state()
    then = go_on(env, actions(12, seed=1))
    env.restore_state(state)
    assert go_on(env, actions(12, seed=1)) == then
    env.reset(seed=5)  # another world in between
    env.restore_state(state)
    assert go_on(env, actions(12, seed=1)) == then
    fresh = TrackedRobotEnv(world=world, dynamics=dynamics, **EVERYTHING)
    fresh.restore_state(pickle.loads(pickle.dumps(state)))
    assert go_on(fresh, actions(12, seed=1)) == then
    assert digest([fresh.reset()[0]]) == digest([env.reset()[0]])  # the generator came along
    env.close()
    fresh.close()


@pytest.mark.parametrize("dynamics", ["bullet", "fast"])
def test_a_state_is_restored_to_the_bit_in_contact_with_a_wall(dynamics: str) -> None:
    env = TrackedRobotEnv(dynamics=dynamics, sensors=("tracks", "imu"))
    env.reset(seed=0)
    forward = np.ones((300, 2), np.float32)
    for action in forward:
        if env.step(action)[4]["collision"]:
            break
    go_on(env, forward[:5])
    state = pickle.loads(pickle.dumps(env.save_state()))
    then = go_on(env, forward[:20])
    env.restore_state(state)
    assert go_on(env, forward[:20]) == then
    fresh = TrackedRobotEnv(dynamics=dynamics, sensors=("tracks", "imu"))
    fresh.restore_state(state)
    assert go_on(fresh, forward[:20]) == then
    env.close()
    fresh.close()


def test_a_saved_generator_spawns_the_same_children() -> None:
    """Also with NumPy 1.26, which pickles and copies generators without their seeds."""
    rng = np.random.default_rng(3)
    rng.spawn(2)
    saved = pickle.loads(pickle.dumps(SavedGenerator.of(rng)))
    children = [rng, *rng.spawn(2)]
    drawn = [child.random() for child in children]
    for _ in range(2):
        again = saved.restored()
        assert [child.random() for child in [again, *again.spawn(2)]] == drawn


_RESTORE = """
import pickle, sys
sys.path.insert(0, sys.argv[1])
from tests.envs.test_standing import EVERYTHING, TrackedRobotEnv, actions, go_on
env = TrackedRobotEnv(**EVERYTHING)
env.restore_state(pickle.load(open(sys.argv[2], "rb")))
print(go_on(env, actions(6, seed=2)))
"""


def test_a_state_is_restored_to_the_bit_in_another_process(
    tmp_path: Path, pytestconfig: pytest.Config
) -> None:
    env = TrackedRobotEnv(**EVERYTHING)
    env.reset(seed=1)
    go_on(env, actions(4))
    kept = tmp_path / "state.pickle"
    kept.write_bytes(pickle.dumps(env.save_state()))
    here = go_on(env, actions(6, seed=2))
    env.close()
    done = subprocess.run(
        [sys.executable, "-c", _RESTORE, str(pytestconfig.rootpath), str(kept)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[-1] == here


def test_a_state_of_other_settings_is_refused() -> None:
    env = TrackedRobotEnv(sensors=("imu",), dynamics="fast")
    env.reset(seed=0)
    other = TrackedRobotEnv(sensors=("imu",), world="room")
    with pytest.raises(
        ValueError, match=r"other settings: world 'yard', here 'room'; dynamics 'fast', here 'bull"
    ):
        other.restore_state(env.save_state())
    env.close()
    other.close()


# --- vectors -------------------------------------------------------------------------------------


def test_a_vector_of_eight_gives_the_bits_of_eight_single_ones() -> None:
    vector = gym.make_vec(ID, 8, vectorization_mode="async", image_size=SMALL, sensors=SENSORS)
    together = [vector.reset(seed=20)[0]]
    course = actions(24).reshape(3, 8, 2)
    together += [vector.step(pair)[0] for pair in course]
    vector.close()
    env = TrackedRobotEnv(image_size=SMALL, sensors=SENSORS)
    for index in range(8):
        alone = [env.reset(seed=20 + index)[0]]
        alone += [env.step(pair[index])[0] for pair in course]
        for one, all_of in zip(alone, together, strict=True):
            assert all(np.array_equal(one[key], all_of[key][index]) for key in one)
    env.close()


@pytest.mark.parametrize("context", [c for c in ("fork", "spawn", "forkserver")])
def test_every_way_to_start_a_process_works(context: str) -> None:
    if context not in multiprocessing.get_all_start_methods():
        pytest.skip(f"this system cannot start processes by {context}")
    vector = gym.make_vec(
        ID, 2, vectorization_mode="async", image_size=SMALL, vector_kwargs={"context": context}
    )
    shown = vector.reset(seed=0)[0]
    env = TrackedRobotEnv(image_size=SMALL)
    assert np.array_equal(env.reset(seed=0)[0]["left"], shown["left"][0])
    vector.close()
    env.close()


# --- bits ----------------------------------------------------------------------------------------

PINNED = "a99a193aacd26eb3f2ebd29b4307952644698dd1a2264ffba5b401f179aa382b"
"""Of the default renderer's pictures below: the same on every processor and with any number of
threads. Whoever changes what a world looks like pins it anew, and says so in the changelog."""


def test_the_default_renderers_pictures_are_pinned() -> None:
    total = sha256()
    for name in ("yard", "forest"):
        world = make_world(name, np.random.default_rng(0))
        renderer = make_renderer(
            "raster", world, Pinhole.with_field_of_view(320, 240, 1.15), color=False
        )
        up = world.start[:2]
        height = float(world.ground.height(up)) + 0.4
        # Rotations of whole numbers: no cosine whose last bit may depend on the processor.
        turns = [np.eye(3), np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])]
        poses = [transform(turn @ R_BASE_OPTICAL, [*up, height]) for turn in turns]
        for image in renderer.images(poses):
            total.update(image.tobytes())
        renderer.close()
    assert total.hexdigest() == PINNED


# --- memory --------------------------------------------------------------------------------------


def test_an_environment_that_is_forgotten_frees_its_physics() -> None:
    env = TrackedRobotEnv(sensors=())
    dynamics = env._robot._dynamics
    assert isinstance(dynamics, BulletDynamics)
    client = dynamics.bullet.client
    del env, dynamics
    gc.collect()
    assert not pybullet.isConnected(client)


@pytest.mark.parametrize(
    "options",
    [
        ["--dynamics", "fast", "--steps", "100000", "--resets", "500"],
        ["--dynamics", "bullet", "--steps", "5000", "--resets", "500"],
        ["--world", "forest", "--steps", "200", "--resets", "40", "--sensors", "left", "right"],
    ],
    ids=["steps", "resets", "images"],
)
def test_memory_does_not_grow(options: list[str]) -> None:
    """`python scripts/soak.py`, in a process of its own; see there."""
    done = subprocess.run(
        [sys.executable, "-m", "grouser.scripts.soak", *options], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "memory grew by" in done.stdout


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--resets", "0"], "--steps and --resets must be at least 1, got 100000 and 0"),
        (["--steps", "-1"], "--steps and --resets must be at least 1, got -1 and 500"),
        (["--world", "mars"], "no world is named 'mars'; known:"),
    ],
)
def test_a_misused_soak_is_told_in_a_line(options: list[str], words: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "grouser.scripts.soak", *options], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert words in done.stderr and "Traceback" not in done.stderr
