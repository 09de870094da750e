"""How fast the simulated robot runs, and how much faster than what most would write."""

from collections.abc import Callable
from itertools import cycle

import numpy as np
from gymnasium.utils.seeding import np_random
from numpy.typing import NDArray

from grouser.envs.sensors.lidar import PlanarLidar
from grouser.envs.sensors.schedule import Schedule
from grouser.envs.sensors.stereo import EYES, Stereo
from grouser.envs.sensors.suite import DEFAULT_SENSORS, SENSORS
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.robot import RobotModel, TrackedRobot
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.envs.tracked_robot import CONTROL_DT, TrackedRobotEnv
from grouser.scripts.benchmark_timing import Figures, Measurement, median_seconds, seconds
from grouser.scripts.naive_stack import NaiveStack

_SEED = 0
_ROUNDS = 8


def whole_environment() -> Figures:
    """Steps a second with stereo 320x240, lidar, tracks and imu, and those of the naive stack.

    The two take turns in the same yard, so that whatever else the machine does slows both.
    """
    env = TrackedRobotEnv()
    env.reset(seed=_SEED)
    naive = NaiveStack(_world(), env.rig, RobotModel())
    actions = cycle(_actions())
    ours, theirs = [], []
    env.step(next(actions))  # the kernels load
    naive.step(next(actions))
    for _ in range(_ROUNDS):
        ours += [seconds(lambda: env.step(next(actions))) for _ in range(12)]
        theirs += [seconds(lambda: naive.step(next(actions))) for _ in range(3)]
    env.close()
    naive.close()
    own_rate, naive_rate = 1 / np.median(ours), 1 / np.median(theirs)
    return {
        "environment.steps_per_second": (float(own_rate), "1/s"),
        "environment.naive_steps_per_second": (float(naive_rate), "1/s"),
        "environment.raster_over_naive": (float(own_rate / naive_rate), "ratio"),
    }


def without_images() -> Figures:
    """Steps a second with lidar, tracks and imu alone, and how long a reset takes."""
    env = TrackedRobotEnv(sensors=[key for key in DEFAULT_SENSORS if key not in EYES])
    env.reset(seed=_SEED)
    actions = cycle(_actions())
    steps = [seconds(lambda: env.step(next(actions))) for _ in range(300)]
    env.close()
    full = TrackedRobotEnv()
    full.reset(seed=_SEED)
    resets = [seconds(full.reset) for _ in range(10)]
    full.close()
    return {
        "environment.steps_per_second_without_images": (float(1 / np.median(steps)), "1/s"),
        "environment.reset_ms": (1e3 * float(np.median(resets)), "ms"),
    }


def parts() -> Figures:
    """Where a step's time goes: physics, a pair of images, one image, a scan."""
    world, rig = _world(), TrackedRobotEnv(sensors=()).rig
    assert rig.stereo is not None and rig.lidar is not None
    robot = TrackedRobot(RobotModel(), dt=CONTROL_DT)
    motion = robot.enter(world)
    action = np.array([0.3, 0.2])
    physics = median_seconds(lambda: robot.step(action), 100)
    robot.close()
    scan = median_seconds(_scan(PlanarLidar(rig.lidar), world, motion), 300)
    pair = Stereo(rig.stereo, eyes=EYES, color=False, dt=rig.dt)
    left = Stereo(rig.stereo, eyes=EYES[:1], color=False, dt=rig.dt)
    pair_time = median_seconds(_scan(pair, world, motion), 60)
    left_time = median_seconds(_scan(left, world, motion), 60)
    pair.close()
    return {
        "environment.physics_us": (1e6 * physics, "us"),
        "environment.lidar_us": (1e6 * scan, "us"),
        "environment.pair_320x240_ms": (1e3 * pair_time, "ms"),
        "environment.image_320x240_ms": (1e3 * left_time, "ms"),
    }


MEASUREMENTS = (
    Measurement(
        whole_environment,
        (
            "environment.steps_per_second",
            "environment.naive_steps_per_second",
            "environment.raster_over_naive",
        ),
    ),
    Measurement(
        without_images,
        ("environment.steps_per_second_without_images", "environment.reset_ms"),
    ),
    Measurement(
        parts,
        (
            "environment.physics_us",
            "environment.lidar_us",
            "environment.pair_320x240_ms",
            "environment.image_320x240_ms",
        ),
    ),
)


def _world() -> World:
    """The yard that `reset` makes of the seed: the first child of its generator."""
    return make_world("yard", np_random(_SEED)[0].spawn(1)[0])


def _actions() -> list[NDArray[np.float32]]:
    """Curves to either side, within the place that is kept clear."""
    return [
        np.array(pair, np.float32)
        for pair in [(0.6, 0.4)] * 20 + [(0.4, 0.6)] * 20 + [(-0.5, 0.5)] * 10
    ]


def _scan(sensor: PlanarLidar | Stereo, world: World, motion: Motion) -> Callable[[], object]:
    rngs = np.random.default_rng(_SEED).spawn(len(SENSORS))
    sensor.enter(world, dict(zip(SENSORS, rngs, strict=True)))
    amounts = Schedule().steady
    return lambda: sensor.read(motion, amounts)
