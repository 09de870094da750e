"""`grouser/TrackedRobot-v0`: a tracked robot in a world, with sensors and without a task."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ClosedEnvironmentError, ResetNeeded
from numpy.typing import NDArray

from grouser.envs.sensors.schedule import Fault, Schedule
from grouser.envs.sensors.suite import DEFAULT_SENSORS, SENSORS, SensorSuite, known_sensors
from grouser.envs.simulation.chase import ChaseView
from grouser.envs.simulation.renderers.registry import installed_renderer
from grouser.envs.simulation.robot import TrackedRobot
from grouser.envs.simulation.robot_model import RobotModel
from grouser.envs.simulation.robot_rig import robot_rig
from grouser.envs.simulation.window import Window
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.recipe import WorldRecipe
from grouser.envs.tracked_robot_arguments import checked_action, checked_image_size, known_mode
from grouser.envs.tracked_robot_state import SavedGenerator, TrackedRobotState
from grouser.envs.tracked_robot_truth import Truth
from grouser.geometry import Array
from grouser.kernels import announce
from grouser.rig import Rig

Observation = dict[str, Any]
Action = NDArray[np.float32]

CONTROL_DT = 0.1
"""Time between two observations, s."""


class TrackedRobotEnv(gym.Env[Observation, Action]):
    """A tracked robot of 40 kg in a world of obstacles, on ground that gives way.

    The action is the speed of the left and right track as a fraction of the top speed (0.5 m/s),
    which the motors follow with a lag of 0.1 s; what is beyond [-1, 1] is clipped, as a motor
    would. There is no task: the reward is 0, and an episode never ends by itself (wrap it in
    `gymnasium.wrappers.TimeLimit`, or in a task of `grouser.agents`).

    `info` holds the truth, for scoring only: `true_pose` (3,) and `true_pose_3d` (4, 4) in the
    frame of the start, `start_pose` (3,) of that frame in the world, `true_twist` (3,) forward,
    left and yaw rate, `track_speed` (2,), `slip` (2,), `icr` (3,) and `effective_width` as
    `grouser.envs.simulation.motion` defines them (all means over the step), `contacts` and
    `collision`.

    Args:
        world: kind of world, of `world_names()`; a new one is generated at every reset.
        difficulty: how hard the world is, from 0 to 1.
        terrain: None for the world's own ground; a material of `MATERIAL_NAMES` everywhere; or
            "mixed", patches of all of them.
        randomize: what varies from one reset to the next beyond the world itself, by name or by
            name and strength in [0, 1]: texture, light, clutter, friction, sensor_noise.
        dynamics: "bullet", or "fast": the same track law on a rigid body of our own.
        renderer: "raster", or "opengl" (needs the extra `opengl`).
        sensors: keys of the observation, of SENSORS (and `stamp`, which is there anyway); the
            others are not computed.
        image_size: width and height of the images, px.
        color: RGB images instead of grey ones.
        effects: how much is wrong with sensors and tracks all the time, by name in
            `grouser.envs.sensors.effects.EFFECTS`: {"stereo.motion_blur": 0.01}.
        faults: what goes wrong for a while: {"what": "stereo.darkness", "start": 5.0, "end": 8.0,
            "amount": 0.9}, s since reset.
        timing: rates [Hz] and latencies [s] of sensors: {"lidar.rate": 5.0, "gps.latency": 0.2}.
        render_mode: None, "rgb_array" (a view from behind), or "human" (the same in a window).

    Raises:
        ValueError: a name that is not known (the message lists those that are), or a size, an
            amount or a time that is out of range.
        ImportError: what the renderer or the window needs is not installed; it says how to.
        RuntimeError: a system library that the renderer needs is not.
    """

    metadata: dict[str, Any] = {
        "render_modes": ["human", "rgb_array"],
        "render_fps": round(1 / CONTROL_DT),
    }

    def __init__(
        self,
        *,
        world: str = "yard",
        difficulty: float = 0.5,
        terrain: str | None = None,
        randomize: Iterable[str] | Mapping[str, float] = (),
        dynamics: str = "bullet",
        renderer: str = "raster",
        sensors: Iterable[str] = DEFAULT_SENSORS,
        image_size: Sequence[int] = (320, 240),
        color: bool = False,
        effects: Mapping[str, float] | None = None,
        faults: Sequence[Mapping[str, Any] | Fault] = (),
        timing: Mapping[str, float] | None = None,
        render_mode: str | None = None,
    ) -> None:
        self._recipe = WorldRecipe(world, difficulty, terrain, randomize)
        self.render_mode = known_mode(render_mode, self.metadata["render_modes"])
        self._schedule = Schedule(effects, faults)
        self._model = RobotModel()
        self.rig: Rig = robot_rig(
            self._model,
            dt=CONTROL_DT,
            image_size=checked_image_size(image_size),
            amounts=self._schedule.steady,
        )
        self._suite = SensorSuite(
            self.rig,
            known_sensors(sensors),
            renderer=installed_renderer(renderer),
            color=color,
            timing=timing,
            fastest_track=2 * self._model.top_speed,
        )
        self.observation_space: spaces.Dict = self._suite.space
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self._robot = TrackedRobot(self._model, dt=CONTROL_DT, dynamics=dynamics)
        announce()
        self._settings = {
            "world": world,
            "difficulty": difficulty,
            "terrain": terrain,
            "randomize": self._recipe.randomize,
            "dynamics": dynamics,
            "sensors": known_sensors(sensors),
            "image_size": checked_image_size(image_size),
            "color": bool(color),
            "renderer": renderer,
            "effects": dict(effects or {}),
            "faults": self._schedule.faults,
            "timing": dict(timing or {}),
        }
        self._window = self._open_window()
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
        world_rng, *sensor_rngs, noise_rng = self.np_random.spawn(2 + len(SENSORS))
        self._take(self._recipe.make(world_rng))
        self._motion = self._robot.enter(self.world)
        self._n_steps = 0
        self._locate(self._motion.T_world_base)
        self._suite.enter(
            self.world,
            dict(zip(SENSORS, sensor_rngs, strict=True)),
            noise_scale=self._recipe.noise_scale(noise_rng),
        )
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
        speed = self._model.top_speed * checked_action(action)
        amounts = self._schedule.at(self._n_steps * CONTROL_DT)
        self._motion = self._robot.step(
            speed, power=_remaining(amounts, "power"), traction=_remaining(amounts, "traction")
        )
        self._n_steps += 1
        self._show()
        return self._observe(), 0.0, False, False, self._info()

    def save_state(self) -> TrackedRobotState:
        """Everything that the rest of the episode depends on, generators included; picklable.

        Raises:
            ResetNeeded: `reset` was not called yet.
            ClosedEnvironmentError: `close` was called.
        """
        self._require_reset()
        assert self._world is not None
        return TrackedRobotState(
            settings=self._settings,
            world=self._world,
            n_steps=self._n_steps,
            motion=self._motion,
            start=self._T_world_start,
            robot=self._robot.save(),
            sensors=self._suite.save(),
            generator=SavedGenerator.of(self.np_random),
        )

    def restore_state(self, state: TrackedRobotState) -> None:
        """Go back to a saved state: the episode goes on bit for bit as it did from there.

        The state may come from another environment, or another process, with the same settings;
        no `reset` is needed. (A wrapper that counts steps goes on counting its own.)

        Raises:
            ValueError: the state is one of other settings; the message says which differ.
            ClosedEnvironmentError: `close` was called.
        """
        self._require_open()
        state.require_settings(self._settings)
        if state.world is not self._world:
            self._take(state.world)
        self._motion, self._n_steps = state.motion, state.n_steps
        self._locate(state.start)
        self._robot.restore(state.robot, state.world)
        self._suite.restore(state.sensors, state.world)
        self.np_random = state.generator.restored()
        self._show()

    @property
    def world(self) -> World:
        """What stands where: a map for planners and drawings, not for estimators.

        Raises:
            ResetNeeded: `reset` was not called yet.
        """
        self._require_reset()
        assert self._world is not None
        return self._world

    def depth(self) -> NDArray[np.float32]:
        """(H, W) distance along the optical axis of what the left camera ideally sees, m; inf for
        the sky. For learning and for tests."""
        return self._suite.depth(self.world, self._motion)

    def segmentation(self) -> NDArray[np.int32]:
        """(H, W) what the left camera ideally sees: 0 sky, 1 ground, then 2 + the index into the
        world's solids, cylinders and slabs, one after another."""
        return self._suite.segmentation(self.world, self._motion)

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
        return self._truth.of(self._motion)

    def _locate(self, T_world_start: Array) -> None:
        """The frame of the start is here."""
        self._T_world_start = T_world_start
        self._truth = Truth(T_world_start, gauge=self._model.tracks.gauge)

    def _take(self, world: World) -> None:
        """From here on this is the world."""
        self._world, self._chase = world, None

    def _show(self) -> None:
        if self._window is not None:
            self._window.show(self._chase_frame())

    def _chase_frame(self) -> NDArray[np.uint8]:
        if self._chase is None:
            self._chase = ChaseView(self.world, self._model)
        return self._chase.frame(self._motion.T_world_base)

    def _open_window(self) -> Window | None:
        if self.render_mode != "human":
            return None
        return Window("Grouser", fps=self.metadata["render_fps"])

    def _require_open(self) -> None:
        if self._closed:
            raise ClosedEnvironmentError("the environment was closed; make a new one")

    def _require_reset(self) -> None:
        self._require_open()
        if self._world is None:
            raise ResetNeeded("call reset() before step() or render()")


def _remaining(amounts: Mapping[str, float], what: str) -> tuple[float, float]:
    """Of the left and right track's power or traction, after what is lost of it."""
    return 1 - amounts[f"left_track.{what}_loss"], 1 - amounts[f"right_track.{what}_loss"]
