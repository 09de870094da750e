"""`grouser/TrackedRobot-v0`: a tracked robot in a world, with sensors and without a task."""

from collections.abc import Iterable, Sequence
from numbers import Integral, Real
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from numpy.typing import NDArray

from grouser.envs.sensors.schedule import Schedule
from grouser.envs.sensors.suite import DEFAULT_SENSORS, SENSORS, SensorSuite, known_sensors
from grouser.envs.simulation.chase import ChaseView
from grouser.envs.simulation.motion import instantaneous_centres, longitudinal_slip
from grouser.envs.simulation.robot import RobotModel, TrackedRobot
from grouser.envs.simulation.robot_rig import robot_rig
from grouser.envs.simulation.window import Window
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world, world_names
from grouser.geometry import Array, inverse_transform, project
from grouser.kernels import announce
from grouser.rig import Rig

Observation = dict[str, Any]
Action = NDArray[np.float32]

CONTROL_DT = 0.1
"""Time between two observations, s."""


class TrackedRobotEnv(gym.Env[Observation, Action]):
    """A tracked robot of 40 kg on gravel, among boxes and walls.

    The action is the speed of the left and right track as a fraction of the top speed (0.5 m/s),
    which the motors follow with a lag of 0.1 s; what is beyond [-1, 1] is clipped, as a motor
    would. There is no task: the reward is 0, and an episode never ends by itself (wrap it in
    `gymnasium.wrappers.TimeLimit`, or in a task of `grouser.agents`).

    `info` holds the truth, for scoring only: `true_pose` (3,) and `true_pose_3d` (4, 4) in the
    frame of the start, `start_pose` (3,) of that frame in the world, `true_twist` (3,) forward,
    left and yaw rate, `slip` (2,) and `icr` (3,) as `grouser.envs.simulation.motion` defines them
    (all three are means over the step), `contacts` and `collision`.

    Args:
        world: kind of world; a new one is generated at every reset.
        sensors: keys of the observation, of SENSORS (and `stamp`, which is there anyway); the
            others are not computed.
        image_size: width and height of the images, px.
        color: RGB images instead of grey ones.
        render_mode: None, "rgb_array" (a view from behind), or "human" (the same in a window).
        image_noise: standard deviation of the images' read noise, grey levels.
        track_noise: white noise of the track increments, as a fraction of them.
        track_resolution: length of track between two encoder counts, m.
        lidar_noise, lidar_bearing_noise: standard deviations of range [m] and bearing [rad].
        acceleration_noise, rate_noise: of the imu, m/s^2 and rad/s.

    Raises:
        ValueError: an unknown world, sensor or render mode (the message lists those there are),
            or a size or a noise that is out of range.
    """

    metadata: dict[str, Any] = {
        "render_modes": ["human", "rgb_array"],
        "render_fps": round(1 / CONTROL_DT),
    }

    def __init__(
        self,
        *,
        world: str = "yard",
        sensors: Iterable[str] = DEFAULT_SENSORS,
        image_size: Sequence[int] = (320, 240),
        color: bool = False,
        render_mode: str | None = None,
        image_noise: float = 1.5,
        track_noise: float = 0.01,
        track_resolution: float = 1e-4,
        lidar_noise: float = 0.01,
        lidar_bearing_noise: float = 1e-3,
        acceleration_noise: float = 0.05,
        rate_noise: float = 2e-3,
    ) -> None:
        self._world_name, self._keys = _known_world(world), known_sensors(sensors)
        self.render_mode = self._known_render_mode(render_mode)
        _require_noises(
            image_noise=image_noise,
            track_noise=track_noise,
            lidar_noise=lidar_noise,
            lidar_bearing_noise=lidar_bearing_noise,
            acceleration_noise=acceleration_noise,
            rate_noise=rate_noise,
        )
        self._schedule = Schedule(
            {
                "stereo.read_noise": image_noise,
                "tracks.noise": track_noise,
                "tracks.resolution": track_resolution,
                "lidar.range_noise": lidar_noise,
                "lidar.bearing_noise": lidar_bearing_noise,
                "imu.acceleration_noise": acceleration_noise,
                "imu.rate_noise": rate_noise,
            }
        )
        self._model = RobotModel()
        self.rig: Rig = robot_rig(
            self._model,
            dt=CONTROL_DT,
            image_size=_checked_size(image_size),
            amounts=self._schedule.steady,
        )
        self._suite = SensorSuite(
            self.rig, self._keys, color=color, fastest_track=2 * self._model.top_speed
        )
        self.observation_space: spaces.Dict = self._suite.space
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        announce()
        self._window = self._open_window()
        self._robot = TrackedRobot(self._model, dt=CONTROL_DT)
        self._closed = False
        self._world: World | None = None
        self._chase: ChaseView | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """A new world, with the robot at rest at its start.

        Raises:
            ValueError: options were given; there are none.
        """
        self._require_open()
        if options:
            raise ValueError(f"reset takes no options, got {sorted(options)}")
        super().reset(seed=seed)
        # One generator a key, asked for or not: leaving a sensor out changes no other's noise.
        world_rng, *sensor_rngs = self.np_random.spawn(1 + len(SENSORS))
        self._world = make_world(self._world_name, world_rng)
        self._chase = None
        self._motion = self._robot.enter(self._world)
        self._n_steps = 0
        self._T_start_world = inverse_transform(self._motion.T_world_base)
        self._start_pose = project(self._motion.T_world_base)
        self._suite.enter(self._world, dict(zip(SENSORS, sensor_rngs, strict=True)))
        self._show()
        return self._observe(), self._info()

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for 0.1 s.

        Raises:
            ValueError: the action is not two finite numbers.
            ResetNeeded: `reset` was not called yet.
            ClosedEnvironmentError: `close` was called.
        """
        self._require_reset()
        speed = self._model.top_speed * _checked_action(action)
        self._motion = self._robot.step(speed)
        self._n_steps += 1
        self._show()
        return self._observe(), 0.0, False, False, self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """A view from behind, RGB (480, 640, 3); None in a window or without a render mode."""
        self._require_reset()
        return self._chase_frame() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Free physics, threads and window; a second call does nothing."""
        self._robot.close()
        self._suite.close()
        if self._window is not None:
            self._window.close()
        self._closed = True

    def _observe(self) -> Observation:
        time = self._n_steps * CONTROL_DT
        return self._suite.observe(self._motion, time, self._schedule.at(time))

    def _info(self) -> dict[str, Any]:
        motion = self._motion
        T_start_base = self._T_start_world @ motion.T_world_base
        return {
            "true_pose": project(T_start_base),
            "true_pose_3d": T_start_base,
            "true_twist": motion.twist.copy(),
            "slip": longitudinal_slip(motion, self._model.tracks.gauge),
            "icr": instantaneous_centres(motion),
            "contacts": motion.contacts,
            "collision": motion.collision,
            "start_pose": self._start_pose.copy(),
        }

    def _show(self) -> None:
        if self._window is not None:
            self._window.show(self._chase_frame())

    def _chase_frame(self) -> NDArray[np.uint8]:
        assert self._world is not None
        if self._chase is None:
            self._chase = ChaseView(self._world, self._model)
        return self._chase.frame(self._motion.T_world_base)

    def _open_window(self) -> Window | None:
        if self.render_mode != "human":
            return None
        return Window("Grouser", fps=self.metadata["render_fps"])

    def _known_render_mode(self, mode: str | None) -> str | None:
        modes = self.metadata["render_modes"]
        if mode is not None and mode not in modes:
            raise ValueError(f"no render mode is named {mode!r}; known: None, {', '.join(modes)}")
        return mode

    def _require_open(self) -> None:
        if self._closed:
            raise ClosedEnvironmentError("the environment was closed; make a new one")

    def _require_reset(self) -> None:
        self._require_open()
        if self._world is None:
            raise ResetNeeded("call reset() before step() or render()")


def _known_world(name: str) -> str:
    if name not in world_names():
        make_world(name, np.random.default_rng(0))  # raises, and says which there are
    return name


def _require_noises(**noises: float) -> None:
    for name, value in noises.items():
        if not (isinstance(value, Real) and 0 <= value < np.inf):
            raise ValueError(f"{name} must be 0 or more, got {value!r}")


def _checked_size(size: Sequence[int]) -> tuple[int, int]:
    listed = tuple(size) if isinstance(size, Iterable) else ()
    if len(listed) != 2 or not all(isinstance(n, Integral) and 16 <= n <= 4096 for n in listed):
        raise ValueError(
            f"image_size must be width and height, whole numbers from 16 to 4096, got {size!r}"
        )
    return int(listed[0]), int(listed[1])


def _checked_action(action: Action) -> Array:
    values = np.asarray(action, dtype=np.float64)
    if values.shape != (2,) or not np.all(np.isfinite(values)):
        raise ValueError(
            "an action is two finite numbers, the left and right track's speed as a fraction of "
            f"the top speed, got {action!r}"
        )
    return np.clip(values, -1.0, 1.0)
