"""The drive that a calibration looks at: replayed from a recording, or simulated."""

from dataclasses import dataclass
from math import radians
from typing import Any

import numpy as np

from grouser.agents.scripted import DRIVES
from grouser.estimators.base import Observation
from grouser.estimators.track_motion import arc_pose, track_increment
from grouser.estimators.visual.offset_calibration import Odometry
from grouser.geometry import Array, compose
from grouser.rig import Rig, camera_mount
from grouser.scripts.calibrate import Calibrate
from grouser.scripts.compare_source import Env, Log, Source, World
from grouser.scripts.usage import UsageError

ODOMETRY_SIGMAS = {"tracks": 0.02, "reference": 0.003}
"""By what share all distances are off together: tracks slip; references are GPS or better."""
_NONE = "none"
_STEPS = 300


@dataclass(frozen=True, slots=True)
class Drive:
    """Everything that was seen, and what else is known of the way."""

    label: str
    rig: Rig
    observations: list[Observation]
    odometry: Odometry | None
    odometry_label: str


def record(options: Calibrate) -> Drive:
    """Replay or simulate.

    Raises:
        UsageError: options that exclude each other, or a source without what is asked for.
        ValueError: as the environment refuses its arguments.
    """
    source = _source(options)
    gives = source.gives()
    name = _odometry(options, gives)
    sensors = ["left", "right", *(["tracks"] if name == "tracks" else [])]
    steps = source.steps(options.steps or (_STEPS if source.drivable else None))
    env = source.make(sensors)
    try:
        rig = env.get_wrapper_attr("rig")
        action = _driver(options, rig) if source.drivable else lambda _: np.zeros(2)
        observations, references = _drive(env, action, options.seed or 0, steps)
    finally:
        env.close()
    odometry = None if name == _NONE else _known(name, options, rig, observations, references)
    return Drive(source.label, rig, observations, odometry, name)


def _source(options: Calibrate) -> Source:
    if (options.log is None) == (options.world is None):
        raise UsageError("give one of --log (a recording) and --world (a simulated drive)")
    if options.steps is not None and options.steps < 1:
        raise UsageError(f"--steps must be at least 1, got {options.steps}")
    if options.log is not None:
        for name in ("offset_px", "driver", "seed"):
            if getattr(options, name) is not None:
                option = name.replace("_", "-")
                raise UsageError(f"--{option} is of a simulated drive and excludes --log")
        return Log(options.log, _camera(options))
    assert options.world is not None
    if _camera(options):
        raise UsageError("--camera-... needs --log; a world knows its own camera")
    offset = options.offset_px or 0.0
    return World(options.world, {"effects": {"stereo.disparity_offset": offset}} if offset else {})


def _camera(options: Calibrate) -> dict[str, Any]:
    """What the command line says of a recording's mount, as overrides of the rig."""
    position = (options.camera_x, options.camera_y, options.camera_z)
    angles = (options.camera_roll_degrees, options.camera_pitch_degrees, options.camera_yaw_degrees)
    if all(value is None for value in (*position, *angles)):
        return {}
    roll, pitch, yaw = (radians(angle or 0.0) for angle in angles)
    mount = camera_mount(*(value or 0.0 for value in position), roll=roll, pitch=pitch, yaw=yaw)
    return {"stereo.T_base_camera": mount.tolist()}


def _odometry(options: Calibrate, gives: frozenset[str]) -> str:
    there = [
        name for name, key in (("tracks", "tracks"), ("reference", "true_pose")) if key in gives
    ]
    name = options.odometry or (there or [_NONE])[0]
    if name not in (*there, _NONE):
        raise UsageError(
            f"--odometry {name!r} is not to be had here; there is: {', '.join((*there, _NONE))}"
        )
    sigma = options.odometry_sigma
    if sigma is not None and (name == _NONE or not 0 < sigma < 1):
        raise UsageError(f"--odometry-sigma is a share from 0 to 1 of an odometry, got {sigma}")
    return name


def _driver(options: Calibrate, rig: Rig) -> Any:
    name = options.driver or "figure-eight"
    if name not in DRIVES:
        raise UsageError(f"there is no driver {name!r}; there are: {', '.join(DRIVES)}")
    return DRIVES[name](rig)


def _drive(env: Env, action: Any, seed: int, steps: int) -> tuple[list[Observation], list[Any]]:
    """Observations, and `true_pose` of each (None where it is not known)."""
    shown, info = env.reset(seed=seed)
    observations, references = [_kept(shown)], [info.get("true_pose")]
    for step in range(steps):
        act = np.asarray(action(step), dtype=env.action_space.dtype)
        shown, _, terminated, truncated, info = env.step(act)
        observations.append(_kept(shown))
        references.append(info.get("true_pose"))
        if terminated or truncated:
            break
    return observations, references


def _kept(observation: Observation) -> Observation:
    return {key: np.array(value) for key, value in observation.items()}


def _known(
    name: str, options: Calibrate, rig: Rig, observations: list[Observation], references: list[Any]
) -> Odometry:
    poses = np.array(references) if name == "reference" else _integrated(rig, observations)
    stamps = np.array([float(observation["stamp"][0]) for observation in observations])
    sigma = ODOMETRY_SIGMAS[name] if options.odometry_sigma is None else options.odometry_sigma
    return Odometry(stamps, poses, sigma)


def _integrated(rig: Rig, observations: list[Observation]) -> Array:
    """(n, 3) poses as the tracks say them."""
    assert rig.tracks is not None
    poses = [np.zeros(3)]
    for observation in observations[1:]:
        arc = track_increment(observation["tracks"], rig.tracks.effective_width)
        poses.append(compose(poses[-1], arc_pose(*arc)))
    return np.array(poses)
