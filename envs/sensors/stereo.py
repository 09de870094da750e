"""A rectified stereo pair: what a renderer draws from both eyes, as real cameras would tell it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.sensors.base import Reading, Sensor
from grouser.envs.sensors.eye import Eye, EyeEffects, EyeMemory, Scene
from grouser.envs.sensors.lens import Lens, displaced
from grouser.envs.sensors.shutter import Shutter
from grouser.envs.sensors.streams import Streams
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.raycast import RayCaster
from grouser.envs.simulation.renderers.base import Renderer
from grouser.envs.simulation.renderers.pinhole import Pinhole
from grouser.envs.simulation.renderers.registry import make_renderer
from grouser.envs.simulation.world import World
from grouser.geometry import Array, rotation_from_rpy, transform
from grouser.rig import StereoCamera

EYES = ("left", "right")

_SUN_IN_REACH = 100.0
"""What is farther away does not hide the sun, m."""


@dataclass(slots=True)
class _Memory:
    eyes: dict[str, EyeMemory]
    steps: int = -1
    """Control steps since the start."""
    read_at: int = 0
    """The step of the last reading."""


class Stereo(Sensor):
    """One or both eyes of a stereo camera.

    Args:
        camera: its calibration.
        eyes: those that are looked through, of EYES; the others are not rendered.
        color: RGB instead of grey.
        dt: length of a control step, s.
        renderer: of RENDERERS.
    """

    _memory: _Memory

    def __init__(
        self,
        camera: StereoCamera,
        *,
        eyes: Sequence[str],
        color: bool,
        dt: float,
        renderer: str = "raster",
    ) -> None:
        self._camera, self._eyes = camera, tuple(eyes)
        self._color, self._renderer_name, self._dt = color, renderer, dt
        self._shape = (camera.height, camera.width, 3 if color else 1)
        self._eye = Eye(Lens(camera))
        self._renderer: Renderer | None = None
        self._caster: RayCaster | None = None

    @property
    def spaces(self) -> dict[str, spaces.Box]:
        return {eye: spaces.Box(0, 255, self._shape, np.uint8) for eye in self._eyes}

    def enter(self, world: World, rngs: Mapping[str, np.random.Generator]) -> None:
        self.close()
        self._memory = _Memory(
            {e: EyeMemory(rngs[e], Streams(rngs[e]), Streams(rngs["left"])) for e in self._eyes}
        )
        self._world, self._caster = world, None
        self._renderer = make_renderer(
            self._renderer_name, world, pinhole(self._camera), color=self._color
        )

    def advance(self, motion: Motion) -> None:
        self._memory.steps += 1

    def read(self, motion: Motion, amounts: Mapping[str, float]) -> Reading:
        effects = {eye: EyeEffects.of(eye, amounts) for eye in self._eyes}
        light = self._look(motion, effects, amounts)
        images = {
            eye: self._eye.image(
                light[eye],
                self._scene(motion, eye, effects[eye]),
                1 + amounts["stereo.gain_mismatch"] if eye == "right" else 1.0,
                effects[eye],
                self._memory.eyes[eye],
            )
            for eye in self._eyes
        }
        self._memory.read_at = self._memory.steps
        return dict(images)

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None

    def _look(
        self, motion: Motion, effects: Mapping[str, EyeEffects], amounts: Mapping[str, float]
    ) -> dict[str, NDArray[np.uint8] | NDArray[np.float32]]:
        """The light that falls into each eye while its shutter is open, grey levels."""
        assert self._renderer is not None, "enter() comes first"
        mounts = {eye: true_mount(self._camera, eye, amounts) for eye in self._eyes}
        shutters = {
            eye: Shutter(
                effects[eye].motion_blur,
                effects[eye].rolling_shutter,
                amounts["stereo.desynchronisation"] if eye == "right" else 0.0,
            )
            for eye in self._eyes
        }
        ages = {e: shutters[e].ages(motion, mounts[e], self._camera.fx) for e in self._eyes}
        poses = [_pose(motion, age) @ mounts[eye] for eye in self._eyes for age in ages[eye]]
        drawn = iter(self._renderer.images(poses))
        pictures = {eye: list(islice(drawn, len(ages[eye]))) for eye in self._eyes}
        light = {
            eye: shown[0] if shutters[eye].is_instant else shutters[eye].expose(shown, ages[eye])
            for eye, shown in pictures.items()
        }
        if "right" in light and amounts["stereo.disparity_offset"] != 0:
            light["right"] = displaced(light["right"], -amounts["stereo.disparity_offset"])
        return light

    def _scene(self, motion: Motion, eye: str, effects: EyeEffects) -> Scene:
        memory = self._memory
        T_world_camera = motion.T_world_base @ mount(self._camera, eye)
        return Scene(
            brightness=0.5 ** (memory.steps * self._dt / self._world.light.half_life),
            sun=self._sun(T_world_camera) if effects.glare else None,
            elapsed=(memory.steps - memory.read_at) * self._dt,
        )

    def _sun(self, T_world_camera: Array) -> Array | None:
        """(3,) towards it, optical frame; None where something stands before it."""
        if self._caster is None:
            self._caster = RayCaster(self._world)
        direction = self._world.light.direction
        free = self._caster.cast(T_world_camera[:3, 3], direction[None], _SUN_IN_REACH)[0]
        return T_world_camera[:3, :3].T @ direction if free >= _SUN_IN_REACH else None


def pinhole(camera: StereoCamera) -> Pinhole:
    """The ideal camera of either eye."""
    return Pinhole(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)


def mount(camera: StereoCamera, eye: str) -> Array:
    """T_base_eye (4, 4) as the rig has it."""
    if eye == "left":
        return camera.T_base_camera
    return camera.T_base_camera @ transform(np.eye(3), [camera.baseline, 0, 0])


def true_mount(camera: StereoCamera, eye: str, amounts: Mapping[str, float]) -> Array:
    """T_base_eye (4, 4) as it truly is."""
    up, left = amounts["stereo.miscalibration"], amounts["stereo.miscalibration_yaw"]
    if eye == "left" or (up == 0 and left == 0):
        return mount(camera, eye)
    # Optical axes are x right, y down, z forward: about x it turns up, about -y to the left.
    return mount(camera, eye) @ transform(rotation_from_rpy(up, -left, 0.0), np.zeros(3))


def _pose(motion: Motion, age: float) -> Array:
    return motion.T_world_base if age == 0 else motion.pose_at(age)
