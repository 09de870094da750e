"""How fast the simulated robot runs, and how much faster than what most would write."""

from collections.abc import Mapping
from functools import partial
from itertools import cycle
from typing import Any, Protocol

import numpy as np
from gymnasium.utils.seeding import np_random
from numpy.typing import NDArray

from grouser.envs.sensors.base import Sensor
from grouser.envs.sensors.lidar import PlanarLidar
from grouser.envs.sensors.schedule import Schedule
from grouser.envs.sensors.stereo import EYES, Stereo
from grouser.envs.sensors.suite import SENSORS
from grouser.envs.simulation.robot import DYNAMICS, RobotModel, TrackedRobot
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world
from grouser.envs.tracked_robot import CONTROL_DT, TrackedRobotEnv
from grouser.scripts.benchmark_timing import (
    Figures,
    Measurement,
    NotAvailable,
    curves,
    median_seconds,
    seconds,
)
from grouser.scripts.naive_stack import NaiveStack

_SEED = 0
_ROUNDS = 8
_BLIND = ("tracks", "lidar", "imu")


def with_images() -> Figures:
    """Steps a second with stereo 320x240, lidar, tracks and imu, and those of the naive stack."""
    rates = _rates({"raster": _env(), "naive": _naive(images=True)}, n=12)
    return {
        "environment.steps_per_second": (rates["raster"], "1/s"),
        "environment.naive_steps_per_second": (rates["naive"], "1/s"),
        "environment.raster_over_naive": (rates["raster"] / rates["naive"], "ratio"),
    }


def with_opengl() -> Figures:
    """The same with images by OpenGL.

    Raises:
        NotAvailable: this machine has no OpenGL, or moderngl is not installed.
    """
    try:
        env = _env(renderer="opengl")
    except (ImportError, RuntimeError) as error:
        raise NotAvailable(str(error)) from error
    rates = _rates({"opengl": env, "naive": _naive(images=True)}, n=12)
    return {"environment.opengl_over_naive": (rates["opengl"] / rates["naive"], "ratio")}


def without_images() -> Figures:
    """The same with lidar, tracks and imu alone, with either dynamics."""
    stacks: dict[str, _Stack] = {
        "bullet": _env(sensors=_BLIND),
        "fast": _env(sensors=_BLIND, dynamics="fast"),
        "naive": _naive(images=False),
    }
    rates = _rates(stacks, n=60)
    return {
        "environment.steps_per_second_without_images": (rates["bullet"], "1/s"),
        "environment.fast_steps_per_second_without_images": (rates["fast"], "1/s"),
        "environment.blind_bullet_over_naive": (rates["bullet"] / rates["naive"], "ratio"),
        "environment.blind_fast_over_naive": (rates["fast"] / rates["naive"], "ratio"),
    }


def reset() -> Figures:
    """How long a new world takes, with images."""
    env = _env()
    resets = [seconds(env.reset) for _ in range(10)]
    env.close()
    return {"environment.reset_ms": (1e3 * float(np.median(resets)), "ms")}


def physics() -> Figures:
    """A control step of either dynamics."""
    times = {}
    for dynamics in DYNAMICS:
        robot = TrackedRobot(RobotModel(), dt=CONTROL_DT, dynamics=dynamics)
        robot.enter(_world())
        times[dynamics] = median_seconds(partial(robot.step, np.array([0.3, 0.2])), 200)
        robot.close()
    return {
        "environment.physics_us": (1e6 * times["bullet"], "us"),
        "environment.fast_physics_us": (1e6 * times["fast"], "us"),
    }


def lidar() -> Figures:
    """A scan of 360 beams among the yard's boxes, and on the forest's uneven ground."""
    rig = TrackedRobotEnv(sensors=()).rig
    assert rig.lidar is not None
    sensor = PlanarLidar(rig.lidar)
    return {
        "environment.lidar_boxes_us": (1e6 * _reading(sensor, _world(), 300), "us"),
        "environment.lidar_terrain_us": (1e6 * _reading(sensor, _world("forest"), 300), "us"),
    }


def images() -> Figures:
    """A pair of images with read noise, and one image."""
    rig = TrackedRobotEnv(sensors=()).rig
    assert rig.stereo is not None
    times = []
    for eyes in (EYES, EYES[:1]):
        sensor = Stereo(rig.stereo, eyes=eyes, color=False, renderer="raster", dt=CONTROL_DT)
        times.append(_reading(sensor, _world(), 60))
        sensor.close()
    return {
        "environment.pair_320x240_ms": (1e3 * times[0], "ms"),
        "environment.image_320x240_ms": (1e3 * times[1], "ms"),
    }


MEASUREMENTS = (
    Measurement(
        with_images,
        (
            "environment.steps_per_second",
            "environment.naive_steps_per_second",
            "environment.raster_over_naive",
        ),
    ),
    Measurement(with_opengl, ("environment.opengl_over_naive",)),
    Measurement(
        without_images,
        (
            "environment.steps_per_second_without_images",
            "environment.fast_steps_per_second_without_images",
            "environment.blind_bullet_over_naive",
            "environment.blind_fast_over_naive",
        ),
    ),
    Measurement(reset, ("environment.reset_ms",)),
    Measurement(physics, ("environment.physics_us", "environment.fast_physics_us")),
    Measurement(lidar, ("environment.lidar_boxes_us", "environment.lidar_terrain_us")),
    Measurement(images, ("environment.pair_320x240_ms", "environment.image_320x240_ms")),
)


class _Stack(Protocol):
    """Whatever can be driven for a step, and freed."""

    def step(self, action: NDArray[np.float32]) -> object: ...

    def close(self) -> None: ...


def _env(**options: Any) -> TrackedRobotEnv:
    env = TrackedRobotEnv(**options)
    env.reset(seed=_SEED)
    return env


def _naive(*, images: bool) -> NaiveStack:
    return NaiveStack(_world(), TrackedRobotEnv(sensors=()).rig, RobotModel(), images=images)


def _rates(stacks: Mapping[str, _Stack], *, n: int) -> dict[str, float]:
    """Steps a second of each stack. They take turns in the same yard, n steps at a time, so that
    whatever else the machine does slows all of them."""
    actions = cycle(curves())
    times: dict[str, list[float]] = {name: [] for name in stacks}
    for stack in stacks.values():
        stack.step(next(actions))  # the kernels load
    for _ in range(_ROUNDS):
        for name, stack in stacks.items():
            turns = max(3, n // 4) if name == "naive" else n
            times[name] += [seconds(lambda s=stack: s.step(next(actions))) for _ in range(turns)]  # type: ignore[misc]
    for stack in stacks.values():
        stack.close()
    return {name: float(1 / np.median(taken)) for name, taken in times.items()}


def _world(name: str = "yard") -> World:
    """The world that `reset` makes of the seed: the first child of its generator."""
    return make_world(name, np_random(_SEED)[0].spawn(1)[0])


def _reading(sensor: Sensor, world: World, n: int) -> float:
    """Seconds that a reading takes at the world's start, the median of n."""
    robot = TrackedRobot(RobotModel(), dt=CONTROL_DT, dynamics="fast")
    motion, amounts = robot.enter(world), Schedule().steady
    rngs = np.random.default_rng(_SEED).spawn(len(SENSORS))
    sensor.enter(world, dict(zip(SENSORS, rngs, strict=True)))
    robot.close()
    return median_seconds(lambda: sensor.read(motion, amounts), n)
