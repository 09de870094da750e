"""A world: what stands where, on what ground, in what light. Frozen values of plain arrays."""

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.ground import Ground
from grouser.frozen import freeze, rebuilt
from grouser.geometry import Array


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """n upright boxes."""

    centre: Array
    """(n, 3) m, in the world frame."""
    half_extents: Array
    """(n, 3) m, along the box's own axes."""
    yaw: Array
    """(n,) rad."""
    texture: NDArray[np.int64]
    """(n,) indices into materials.TEXTURES."""

    def __post_init__(self) -> None:
        freeze(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return rebuilt(self)

    def __len__(self) -> int:
        return len(self.yaw)

    @staticmethod
    def none() -> "Boxes":
        """No box."""
        return Boxes(np.empty((0, 3)), np.empty((0, 3)), np.empty(0), np.empty(0, dtype=np.int64))

    @property
    def footprint_radius(self) -> Array:
        """(n,) radius of the circle around each box seen from above, m."""
        return np.hypot(self.half_extents[:, 0], self.half_extents[:, 1])


@dataclass(frozen=True, slots=True, eq=False)
class Cylinders:
    """n upright cylinders: trunks, posts."""

    centre: Array
    """(n, 3) m, of the axis at half height, in the world frame."""
    radius: Array
    """(n,) m."""
    half_height: Array
    """(n,) m."""
    texture: NDArray[np.int64]
    """(n,) indices into materials.TEXTURES."""

    def __post_init__(self) -> None:
        freeze(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return rebuilt(self)

    def __len__(self) -> int:
        return len(self.radius)

    @staticmethod
    def none() -> "Cylinders":
        """No cylinder."""
        return Cylinders(np.empty((0, 3)), np.empty(0), np.empty(0), np.empty(0, dtype=np.int64))


def join(*parts: Boxes) -> Boxes:
    """The boxes of all parts, in order."""
    return Boxes(
        *(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Boxes))
    )


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """One distant light, what comes from everywhere, and the sky."""

    direction: Array = field(
        default_factory=lambda: np.array([0.40, 0.25, 0.88]) / np.linalg.norm([0.40, 0.25, 0.88])
    )
    """(3,) unit vector towards the sun, world frame."""
    ambient: float = 0.55
    """Brightness of what lies in the shade, at most 1 - direct."""
    direct: float = 0.45
    """Brightness that the sun adds to what faces it."""
    horizon: Array = field(default_factory=lambda: np.array([176.0, 203.0, 230.0]))
    """(3,) RGB of the sky at the horizon, grey levels."""
    zenith: Array = field(default_factory=lambda: np.array([176.0, 203.0, 230.0]))
    """(3,) RGB of the sky overhead, grey levels."""
    half_life: float = np.inf
    """Time in which the light falls to a half, s: dusk."""

    def __post_init__(self) -> None:
        freeze(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return rebuilt(self)


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """Solid things on a ground, and where the robot starts."""

    name: str
    solids: Boxes
    """What nothing drives over: obstacles first, then the walls."""
    n_walls: int
    ground: Ground
    start: Array
    """(3,) pose at which the robot starts: x [m], y [m], heading [rad]."""
    clear_radius: float
    """The robot's centre may be driven anywhere within this of the start and touch nothing, m."""
    cylinders: Cylinders = field(default_factory=Cylinders.none)
    """Upright solid things too: trunks and posts."""
    slabs: Boxes = field(default_factory=Boxes.none)
    """Low boxes that tracks climb: steps, sills, kerbs, rubble. Their flat tops are ground."""
    goals: Array = field(default_factory=lambda: np.empty((0, 2)))
    """(m, 2) places that the robot can drive to from the start, m."""
    light: Light = field(default_factory=Light)

    def __post_init__(self) -> None:
        freeze(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return rebuilt(self)
