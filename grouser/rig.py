"""What an estimator may know of its robot: the calibration of its tracks and sensors.

Frozen values of plain numbers and read-only arrays, so that a rig can be pickled, compared,
written to YAML and handed to an estimator in another process.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import ArrayLike

from grouser.checks import (
    require_finite,
    require_not_negative,
    require_positive,
    require_whole,
)
from grouser.frozen import rebuilt
from grouser.geometry import Array, inverse_transform, rotation_from_rpy, transform
from grouser.rig_motion import LineSensor, Odometry, Steering

# Columns: the optical axes (x right, y down, z forward) in the base frame (x forward, y left, z up)
R_BASE_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
R_BASE_OPTICAL.setflags(write=False)


def camera_mount(
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    *,
    roll: float = 0.0,
    pitch: float = 0.0,
    yaw: float = 0.0,
) -> Array:
    """T_base_camera (4, 4) of a camera at (x, y, z) [m]; positive pitch [rad] looks down."""
    return transform(rotation_from_rpy(roll, pitch, yaw) @ R_BASE_OPTICAL, [x, y, z])


def _frozen(value: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    array = np.array(value, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {array.tolist()}")
    array.setflags(write=False)
    return array


def _frozen_mount(value: ArrayLike, name: str) -> Array:
    T = _frozen(value, (4, 4), name)
    R = T[:3, :3]
    rigid = np.allclose(R @ R.T, np.eye(3), atol=1e-6) and np.linalg.det(R) > 0
    if not (rigid and np.array_equal(T[3], [0, 0, 0, 1])):
        raise ValueError(
            f"{name} must be a rigid transform, a rotation beside a translation above "
            f"[0, 0, 0, 1], got {T.tolist()}"
        )
    return T


@dataclass(frozen=True, slots=True)
class TrackGeometry:
    """The two tracks: `gauge` and `effective_width` replace the paper's D + 2b in eq. (4)."""

    gauge: float
    """Distance between the centre lines of the tracks, m."""
    width: float
    """Width of one track, m."""
    effective_width: float
    """(u_R - u_L) / yaw rate as calibrated on typical ground, m: more than the gauge, by slip."""

    def __post_init__(self) -> None:
        require_positive(self, "gauge", "width", "effective_width")


@dataclass(frozen=True, slots=True, eq=False)
class StereoCamera:
    """A rectified stereo pair; the left camera is the reference. Pixel centres are at integers."""

    fx: float
    """Focal length, px."""
    fy: float
    cx: float
    """Principal point, px."""
    cy: float
    baseline: float
    """Distance from the left to the right optical centre, m."""
    width: int
    height: int
    T_base_camera: Array
    """(4, 4) left camera's optical frame in the robot frame."""
    mount_sigma: Array = field(default_factory=lambda: np.zeros(6))
    """(6,) how well T_base_camera is known: x, y, z [m], roll, pitch, yaw [rad], one sigma."""
    disparity_offset: float = 0.0
    """Measured minus true disparity, px (a residual of the rectification)."""
    disparity_sigma: float = 0.0
    """How well that is known, px: all distances are off together by its share of the disparity."""

    def __post_init__(self) -> None:
        require_positive(self, "fx", "fy", "baseline")
        require_whole(self, "width", "height")
        require_finite(self, "cx", "cy", "disparity_offset")
        require_not_negative(self, "disparity_sigma", "mount_sigma")
        T = _frozen_mount(self.T_base_camera, "StereoCamera.T_base_camera")
        sigma = _frozen(self.mount_sigma, (6,), "StereoCamera.mount_sigma")
        object.__setattr__(self, "T_base_camera", T)
        object.__setattr__(self, "mount_sigma", sigma)

    @property
    def T_camera_base(self) -> Array:
        """(4, 4) the robot frame in the left camera's optical frame."""
        return inverse_transform(self.T_base_camera)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, StereoCamera) and _plain(self) == _plain(other)

    def __hash__(self) -> int:
        return hash((self.fx, self.fy, self.cx, self.cy, self.baseline, self.width, self.height))

    def __reduce__(self) -> tuple[Any, ...]:
        return rebuilt(self)


@dataclass(frozen=True, slots=True, eq=False)
class Lidar:
    """A planar lidar; beam i points along angle_min + i * angle_increment in its x-y plane."""

    n_beams: int
    angle_min: float
    """rad"""
    angle_increment: float
    """rad"""
    range_min: float
    """m"""
    range_max: float
    """m; also the reading of a beam that hit nothing"""
    sigma_range: float
    """m"""
    sigma_bearing: float
    """rad"""
    T_base_lidar: Array
    """(4, 4) the sensor frame (x forward, y left, z up) in the robot frame."""
    sweep_time: float = 0.0
    """From sending the first beam to sending the last, which is at the scan's stamp, s."""

    def __post_init__(self) -> None:
        require_whole(self, "n_beams")
        require_positive(self, "range_max")
        require_finite(self, "angle_min", "angle_increment")
        require_not_negative(self, "range_min", "sigma_range", "sigma_bearing", "sweep_time")
        if self.range_min >= self.range_max:
            raise ValueError(
                f"Lidar.range_min must be less than range_max, {self.range_max} m, "
                f"got {self.range_min} m"
            )
        T = _frozen_mount(self.T_base_lidar, "Lidar.T_base_lidar")
        object.__setattr__(self, "T_base_lidar", T)

    @property
    def bearings(self) -> Array:
        """(n_beams,) rad."""
        return self.angle_min + self.angle_increment * np.arange(self.n_beams, dtype=np.float64)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Lidar) and _plain(self) == _plain(other)

    def __hash__(self) -> int:
        return hash((self.n_beams, self.angle_min, self.angle_increment, self.range_max))

    def __reduce__(self) -> tuple[Any, ...]:
        return rebuilt(self)


@dataclass(frozen=True, slots=True)
class Imu:
    """White noise of an inertial unit at the robot's origin, averaged over one step."""

    sigma_acceleration: float
    """m/s^2"""
    sigma_rate: float
    """rad/s"""

    def __post_init__(self) -> None:
        require_not_negative(self, "sigma_acceleration", "sigma_rate")


@dataclass(frozen=True, slots=True)
class Gps:
    """A satellite receiver at the robot's origin: position fixes in the frame of the start."""

    sigma_position: float
    """White noise of either coordinate, m."""

    def __post_init__(self) -> None:
        require_not_negative(self, "sigma_position")


@dataclass(frozen=True, slots=True)
class Rig:
    """The calibration of one robot. What the robot, or its recording, does not have is None."""

    dt: float
    """Time between two observations, s."""
    tracks: TrackGeometry | None = None
    stereo: StereoCamera | None = None
    lidar: Lidar | None = None
    imu: Imu | None = None
    gps: Gps | None = None
    steering: Steering | None = None
    odometry: Odometry | None = None
    line_sensor: LineSensor | None = None

    def __post_init__(self) -> None:
        require_positive(self, "dt")
        for name, kind in _PARTS.items():
            part = getattr(self, name)
            if not (part is None or isinstance(part, kind)):
                raise ValueError(f"Rig.{name} must be a {kind.__name__} or None, got {part!r}")

    def with_overrides(self, overrides: Mapping[str, Any]) -> "Rig":
        """A rig with some values replaced, by dotted name: {"stereo.T_base_camera": T}.

        Raises:
            ValueError: a name that the rig does not have; it lists those it has.
        """
        rig = self
        for name, value in overrides.items():
            allowed = sorted(_dotted_names(rig))
            if name not in allowed:
                raise ValueError(
                    f"the rig has no {name!r} to override; it has: {', '.join(allowed)}"
                )
            part_name, _, field_name = name.partition(".")
            if field_name:
                value = replace(getattr(rig, part_name), **{field_name: value})
            rig = replace(rig, **{part_name: value})
        return rig

    def to_yaml(self, path: str | Path) -> None:
        """Write the rig as YAML; `from_yaml` reads the same rig back."""
        Path(path).write_text(yaml.safe_dump(_plain(self), sort_keys=False))

    @staticmethod
    def from_yaml(path: str | Path) -> "Rig":
        """Read a rig.

        Raises:
            ValueError: the file is not YAML, or an entry is missing, unknown or malformed.
        """
        try:
            data = yaml.safe_load(Path(path).read_text())
            parts = {
                name: None if data.get(name) is None else kind(**data[name])
                for name, kind in _PARTS.items()
            }
            unknown = set(data) - set(_PARTS) - {"dt"}
            if unknown:
                raise ValueError(f"unknown entries {sorted(unknown)}")
            return Rig(dt=data["dt"], **parts)
        except (yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{path} is not a rig: {error}; expected dt, {_EXPECTED}") from error


_PARTS: dict[str, Any] = {
    "tracks": TrackGeometry,
    "stereo": StereoCamera,
    "lidar": Lidar,
    "imu": Imu,
    "gps": Gps,
    "steering": Steering,
    "odometry": Odometry,
    "line_sensor": LineSensor,
}
_EXPECTED = ", ".join(_PARTS)


def _field_names(part: Any) -> list[str]:
    return [f.name for f in fields(part)]


def _dotted_names(rig: Rig) -> list[str]:
    parts = {name: getattr(rig, name) for name in _PARTS}
    present = {name: part for name, part in parts.items() if part is not None}
    nested = [f"{name}.{inner}" for name, part in present.items() for inner in _field_names(part)]
    return [*_field_names(rig), *nested]


def _plain(value: Any) -> Any:
    """The value as nested dictionaries and lists of plain numbers."""
    if hasattr(value, "__dataclass_fields__"):
        return {name: _plain(getattr(value, name)) for name in _field_names(value)}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value
