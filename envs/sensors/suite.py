"""All the sensors of the robot: they measure one after another, and each has its noise."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from grouser.envs.sensors.base import Sensor
from grouser.envs.sensors.delivery import LONGEST_STAMP, Delivered, Timing, timing_of
from grouser.envs.sensors.effects import NOISES
from grouser.envs.sensors.gps import SatelliteReceiver
from grouser.envs.sensors.ideal_eye import IdealEye
from grouser.envs.sensors.imu import InertialUnit
from grouser.envs.sensors.lidar import PlanarLidar
from grouser.envs.sensors.stereo import EYES, Stereo
from grouser.envs.sensors.tracks import TrackEncoders
from grouser.envs.simulation.motion import Motion
from grouser.envs.simulation.world import World
from grouser.rig import Rig

DEFAULT_SENSORS = ("left", "right", "tracks", "lidar", "imu")
"""What is observed where nothing else is asked for."""

SENSORS = (*DEFAULT_SENSORS, "gps")
"""Every key of the observation that can be asked for; `stamp` is always there."""


def known_sensors(names: Iterable[str]) -> tuple[str, ...]:
    """Keys of the observation, in the order of SENSORS.

    Raises:
        ValueError: one of the names is none of SENSORS; the message lists them.
    """
    if not isinstance(names, Iterable):
        raise ValueError(f"sensors must be names of: {', '.join(SENSORS)}, got {names!r}")
    listed = (names,) if isinstance(names, str) else tuple(names)
    unknown = [name for name in listed if name not in (*SENSORS, "stamp")]
    if unknown:
        raise ValueError(
            f"no sensor is named {unknown[0]!r}; known: {', '.join(SENSORS)} (and stamp, always)"
        )
    return tuple(name for name in SENSORS if name in listed)


class SensorSuite:
    """Those sensors that give one of the keys.

    Args:
        rig: the robot's calibration.
        keys: of SENSORS; the others are not computed.
        renderer: what draws the images, of RENDERERS.
        color: RGB images instead of grey ones.
        timing: rates [Hz] and latencies [s], as `timing_of` takes them.
        fastest_track: highest speed that a track encoder reads, m/s.

    Raises:
        ValueError: a timing that is unknown or out of range.
    """

    def __init__(
        self,
        rig: Rig,
        keys: Sequence[str],
        *,
        renderer: str = "raster",
        color: bool = False,
        timing: Mapping[str, float] | None = None,
        fastest_track: float,
    ) -> None:
        timings = {key: timing_of(key, timing or {}, rig.dt) for key in SENSORS}
        made = _sensors(rig, renderer, color, fastest_track, timings, keys)
        self._sensors = [_delivered(sensor, timings, rig.dt) for sensor in made]
        self._world: World | None = None
        self._noise = _NoiseScale(1.0)
        assert rig.stereo is not None
        self._ideal_eye = IdealEye(rig.stereo, renderer)

    @property
    def space(self) -> spaces.Dict:
        """Of the observations."""
        parts: dict[str, spaces.Space[Any]] = {
            "stamp": spaces.Box(0.0, LONGEST_STAMP, (1,), np.float64)
        }
        for sensor in self._sensors:
            parts.update(sensor.spaces)
        return spaces.Dict(parts)

    def enter(
        self,
        world: World,
        rngs: Mapping[str, np.random.Generator],
        *,
        noise_scale: float = 1.0,
    ) -> None:
        """Start anew in a world.

        Args:
            rngs: a fresh generator for each of SENSORS.
            noise_scale: all noises (effects.NOISES) are multiplied by this.
        """
        self._world, self._noise = world, _NoiseScale(noise_scale)
        for sensor in self._sensors:
            sensor.enter(world, rngs)

    def observe(
        self, motion: Motion, time: float, amounts: Mapping[str, float]
    ) -> dict[str, NDArray[Any]]:
        """The observation after a motion, which ends at a time [s since the start]; to be called
        once a control step, first for standing at the start."""
        scaled = self._noise.applied_to(amounts)
        observation: dict[str, NDArray[Any]] = {"stamp": np.array([time])}
        for sensor in self._sensors:
            sensor.advance(motion)
            observation.update(sensor.read(motion, scaled))
        return observation

    def save(self) -> Any:
        """Everything that changes within an episode; picklable."""
        return self._noise.scale, [sensor.save() for sensor in self._sensors]

    def restore(self, saved: Any, world: World) -> None:
        """Go on, bit for bit, from where `save` was called, which was in this world."""
        scale, memories = saved
        if world is not self._world:
            self.enter(world, {key: np.random.default_rng(0) for key in SENSORS})
        self._noise = _NoiseScale(scale)
        for sensor, memory in zip(self._sensors, memories, strict=True):
            sensor.restore(memory)

    def depth(self, world: World, motion: Motion) -> NDArray[np.float32]:
        """(H, W) along the optical axis of what the left eye ideally sees, m; inf for the sky."""
        return self._ideal_eye.depth(world, motion)

    def segmentation(self, world: World, motion: Motion) -> NDArray[np.int32]:
        """(H, W) what it ideally sees, as `Renderer.segmentation` numbers it."""
        return self._ideal_eye.segmentation(world, motion)

    def close(self) -> None:
        """Free what the sensors hold; a second call does nothing."""
        self._world = None
        self._ideal_eye.close()
        for sensor in self._sensors:
            sensor.close()


class _NoiseScale:
    """Multiplies the noises among the effects' amounts."""

    def __init__(self, scale: float) -> None:
        self.scale = scale
        self._given: Mapping[str, float] | None = None
        self._scaled: Mapping[str, float] = {}

    def applied_to(self, amounts: Mapping[str, float]) -> Mapping[str, float]:
        if self.scale == 1.0:
            return amounts
        if amounts is not self._given:  # a schedule gives the same object until something changes
            noises = {name: self.scale * amounts[name] for name in NOISES}
            self._given, self._scaled = amounts, dict(amounts) | noises
        return self._scaled


def _sensors(
    rig: Rig,
    renderer: str,
    color: bool,
    fastest_track: float,
    timings: Mapping[str, Timing],
    keys: Sequence[str],
) -> list[Sensor]:
    assert rig.stereo is not None and rig.lidar is not None
    farthest = fastest_track * rig.dt * timings["tracks"].period
    single: dict[str, Sensor] = {
        "tracks": TrackEncoders(limit=farthest),
        "lidar": PlanarLidar(rig.lidar),
        "imu": InertialUnit(dt=rig.dt),
        "gps": SatelliteReceiver(dt=rig.dt),
    }
    stereo = [
        Stereo(rig.stereo, eyes=eyes, color=color, renderer=renderer, dt=rig.dt)
        for eyes in _looking_together([key for key in keys if key in EYES], timings)
    ]
    return [*stereo, *(sensor for key, sensor in single.items() if key in keys)]


def _looking_together(eyes: Sequence[str], timings: Mapping[str, Timing]) -> list[list[str]]:
    """Groups of eyes that always look at the same time."""
    alike = len({timings[eye] for eye in eyes}) == 1
    return [list(eyes)] if alike else [[eye] for eye in eyes]


def _delivered(sensor: Sensor, timings: Mapping[str, Timing], dt: float) -> Sensor:
    """The sensor with its timing, where that is not to be seen at every step and at once."""
    (timing,) = {timings[key] for key in sensor.spaces}
    return sensor if timing == Timing() else Delivered(sensor, timing, dt=dt)
