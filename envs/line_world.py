"""`grouser/LineWorld-v0`: paper 2's planar world of line landmarks, without a task."""

import copy
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from grouser.checks import did_you_mean
from grouser.envs.plane.picture import PlanePicture
from grouser.envs.plane.plane_rig import noises, plane_rig
from grouser.envs.plane.sight import SIGHTS, Sight
from grouser.envs.plane.vehicles import (
    Moved,
    SteeredVehicle,
    TrackedVehicle,
    Vehicle,
    standing_at,
)
from grouser.envs.plane.world import PlaneWorld, make_plane_world
from grouser.envs.sensors.delivery import LONGEST_STAMP
from grouser.envs.sensors.line_observer import LineObserver, make_line_observer
from grouser.envs.tracked_robot_arguments import checked_action, known_mode
from grouser.envs.tracked_robot_state import SavedGenerator
from grouser.geometry import between, lift
from grouser.rig import Rig

Observation = dict[str, Any]
Action = NDArray[np.floating[Any]]

_STREAMS = ("motion", *SIGHTS)
"""Each has a generator of its own, asked for or not: leaving one out changes no other's noise."""


@dataclass(frozen=True, slots=True, eq=False)
class LineWorldState:
    """A moment of an episode; it can be pickled, and goes with the same arguments only."""

    step: int
    moved: Moved
    sight: Any
    rngs: Mapping[str, SavedGenerator]
    generator: SavedGenerator
    """The environment's own, of which the next episode's will be made."""


class LineWorldEnv(gym.Env[Observation, Action]):
    """A vehicle among line segments on a plane, through which its line sensor sees.

    The vehicle does exactly what its action says; noise is in what it reports of that and in what
    its sensors measure (SPEC 2.0). There is no task and no collision: the reward is 0, and an
    episode ends by truncation only, after `max_steps`.

    With `motion="steering"` (paper 2, eq. (5)) the action is the front wheel's speed and angle as
    a fraction of their maximum, the angle no faster than its largest rate, and `steering` (2,)
    reports speed [m/s] and angle [rad]. With `motion="tracks"` it is the speed of the left and
    right track as a fraction of the top speed, and `tracks` (2,) reports their increments [m].

    `lines` (max_lines, 4) shows range [m] and bearing [rad] of both ends of what is visible of
    each segment (at least 1 m), `lidar` (n_beams,) a scan, in which what is near hides what is
    behind it. `points` (max_lines, 2) shows range [m] and bearing [rad] of one point of each
    of those lines, the foot of the world's origin on it, by which paper 2 names a line. All are of
    every `observe_every`-th step; `lines_stamp`, `lidar_stamp` and `points_stamp` say of when. In
    between, `lines` and `points` are all zeros and `lidar` the last scan.

    `info` holds the truth, for scoring only: `true_pose` (3,) and `true_pose_3d` (4, 4) in the
    frame of the start, `start_pose` (3,) of that frame in the world, `true_twist` (3,) forward,
    left and yaw rate, `true_controls` (2,) what was reported without noise, and `true_visible`
    (n, 4) both ends of what was within range of each segment when the sensors last looked, in the
    world [m], zeros where nothing was.

    Args:
        world: "yan-normal", "yan-over-range", or segments [[ax, ay, bx, by], ...] in m.
        motion: "steering" or "tracks".
        sensors: keys of the observation: "steering" or "tracks", "lines", "lidar", "points" (and
            `stamp`, which is there anyway); what moves and `lines` when None.
        start: x, y [m] and heading [rad] at the start, in the world; its own when None.
        dt: time between two steps, s.
        speed: largest speed of the front wheel or of a track, m/s.
        noise: a number that multiplies all of NOISES, or standard deviations by name, such as
            {"speed": 0.0, "range": 0.05}.
        range_max: how far the sensors see, m.
        n_beams: beams of the scan, all around.
        observe_every: steps from one look of the sensors to the next.
        observer: what finds the visible parts: of OBSERVERS, or one that was made.
        rig: other values of the calibration by dotted name, such as {"steering.wheelbase": 2.0}.
        max_steps: steps of an episode; no end when None.
        render_mode: None, or "rgb_array": the plane from above.

    Raises:
        ValueError: a name that is not known (the message lists those that are), or a value that
            is out of range.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 40}

    def __init__(
        self,
        *,
        world: str | ArrayLike = "yan-normal",
        motion: str = "steering",
        sensors: Iterable[str] | None = None,
        start: Sequence[float] | None = None,
        dt: float = 0.025,
        speed: float = 3.0,
        noise: float | Mapping[str, float] = 1.0,
        range_max: float = 30.0,
        n_beams: int = 360,
        observe_every: int = 8,
        observer: str | LineObserver = "closed-form",
        rig: Mapping[str, Any] | None = None,
        max_steps: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.world: PlaneWorld = make_plane_world(world, start=start)
        """What stands where, and the course; for drivers and drawings, not for estimators."""
        sigmas = noises(noise)
        self.rig: Rig = plane_rig(
            motion,
            dt=dt,
            speed=speed,
            range_max=range_max,
            n_beams=n_beams,
            max_lines=len(self.world.segments),
            noise=sigmas,
        ).with_overrides(rig or {})
        _require_parts(self.rig, motion, len(self.world.segments))
        self.sensors = _known_sensors(sensors, motion)
        self.render_mode = known_mode(render_mode, self.metadata["render_modes"])
        self.metadata = {**self.metadata, "render_fps": max(1, round(1 / self.rig.dt))}
        self._max_steps = None if max_steps is None else _whole("max_steps", max_steps)
        self._motion = motion
        self._vehicle = _vehicle(self.rig, top_speed=speed, track_noise=sigmas["tracks"])
        self._sight = Sight(
            self.rig,
            self.sensors,
            observer=make_line_observer(observer) if isinstance(observer, str) else observer,
            every=_whole("observe_every", observe_every),
        )
        self.observation_space: spaces.Dict = self._space()
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self._moved: Moved | None = None
        self._picture: PlanePicture | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Stand at the start, with new noise.

        Raises:
            ValueError: options were given; there are none.
        """
        if options:
            raise ValueError(f"reset takes no options, got {sorted(options)}")
        super().reset(seed=seed)
        children = self.np_random.spawn(len(_STREAMS))
        self._rngs = dict(zip(_STREAMS, children, strict=True))
        self._step, self._moved = 0, standing_at(self.world.start)
        self._picture = None
        return self._observe(self._moved), self._info(self._moved)

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for one step; what is beyond [-1, 1] of the action is clipped.

        Raises:
            ValueError: the action is not two finite numbers.
            ResetNeeded: `reset` was not called yet.
        """
        self._moved = self._vehicle.drive(self._now(), checked_action(action))
        self._step += 1
        truncated = self._max_steps is not None and self._step >= self._max_steps
        return self._observe(self._moved), 0.0, False, truncated, self._info(self._moved)

    def render(self) -> NDArray[np.uint8] | None:
        """The plane from above, RGB (480, 640, 3): the segments, what of them was last visible,
        the course, the way since the first call, and the vehicle. None without a render mode."""
        moved = self._now()
        if self.render_mode is None:
            return None
        if self._picture is None:
            assert self.rig.line_sensor is not None
            self._picture = PlanePicture(self.world, reach=self.rig.line_sensor.range_max)
        return self._picture.draw(moved.pose, self._sight.visible)

    def save_state(self) -> LineWorldState:
        """Everything that the rest of the episode depends on, generators included; picklable.

        Raises:
            ResetNeeded: `reset` was not called yet.
        """
        moved = self._now()
        return LineWorldState(
            step=self._step,
            moved=moved,
            sight=self._sight.save(),
            rngs={name: SavedGenerator.of(rng) for name, rng in self._rngs.items()},
            generator=SavedGenerator.of(self.np_random),
        )

    def restore_state(self, state: LineWorldState) -> None:
        """Go back to a saved state, of an environment with the same arguments: the episode goes
        on bit for bit as it did from there."""
        self._step, self._moved = state.step, copy.deepcopy(state.moved)
        self._sight.restore(state.sight)
        self._rngs = {name: saved.restored() for name, saved in state.rngs.items()}
        self.np_random = state.generator.restored()
        self._picture = None

    def _now(self) -> Moved:
        if self._moved is None:
            raise ResetNeeded("call reset() before step(), render() or save_state()")
        return self._moved

    def _observe(self, moved: Moved) -> Observation:
        shown: Observation = {"stamp": np.array([self._step * self.rig.dt])}
        if self._motion in self.sensors:
            shown[self._motion] = self._vehicle.report(moved, self._rngs["motion"])
        looked = self._sight.look(self._step, self.world.segments, moved.pose, self._rngs)
        return shown | looked

    def _info(self, moved: Moved) -> dict[str, Any]:
        pose = between(self.world.start, moved.pose)
        return {
            "true_pose": pose,
            "true_pose_3d": lift(pose),
            "true_twist": moved.twist.copy(),
            "true_controls": moved.controls.copy(),
            "true_visible": np.nan_to_num(self._sight.visible),
            "start_pose": self.world.start.copy(),
        }

    def _space(self) -> spaces.Dict:
        stamp = spaces.Box(0.0, LONGEST_STAMP, (1,), np.float64)
        moves = {self._motion: self._vehicle.space} if self._motion in self.sensors else {}
        return spaces.Dict({"stamp": stamp, **moves, **self._sight.spaces})


def _vehicle(rig: Rig, *, top_speed: float, track_noise: float) -> Vehicle:
    if rig.steering is not None:
        return SteeredVehicle(rig.steering, dt=rig.dt)
    assert rig.tracks is not None
    width = rig.tracks.effective_width
    return TrackedVehicle(width=width, top_speed=top_speed, noise=track_noise, dt=rig.dt)


def _known_sensors(sensors: Iterable[str] | None, motion: str) -> tuple[str, ...]:
    """Keys of the observation but `stamp`, in a fixed order."""
    known = (motion, *SIGHTS)
    if sensors is None:
        return (motion, "lines")
    listed = (sensors,) if isinstance(sensors, str) else tuple(sensors)
    unknown = [name for name in listed if name not in (*known, "stamp")]
    if unknown:
        raise ValueError(
            f"a vehicle with motion={motion!r} has no sensor {unknown[0]!r}; "
            f"{did_you_mean(unknown[0], known)}it has: {', '.join(known)} (and stamp, always)"
        )
    return tuple(name for name in known if name in listed)


def _require_parts(rig: Rig, motion: str, n_segments: int) -> None:
    """What the overrides of the rig leave must be a vehicle of this motion that sees."""
    parts = (motion, "line_sensor", "lidar")
    gone = [name for name in parts if getattr(rig, name) is None]
    other = "tracks" if motion == "steering" else "steering"
    if gone or getattr(rig, other) is not None:
        raise ValueError(
            f"a rig with motion={motion!r} has {', '.join(parts)} and no {other}; override values "
            "of those, and choose the motion by motion="
        )
    assert rig.line_sensor is not None
    if rig.line_sensor.max_lines < n_segments:
        raise ValueError(
            f"line_sensor.max_lines must be at least the number of segments, {n_segments}, "
            f"got {rig.line_sensor.max_lines}"
        )


def _whole(name: str, value: int) -> int:
    if not (isinstance(value, int | np.integer) and value > 0):
        raise ValueError(f"{name} must be a whole number above zero, got {value!r}")
    return int(value)
