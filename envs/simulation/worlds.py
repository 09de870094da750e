"""Worlds: what stands where. Frozen values, made by seeded generators, known by name."""

import difflib
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from grouser.geometry import Array

TEXTURES = ("gravel", "brick", "plaster", "pebbles", "blocks", "concrete")
"""Names of the textures that a world may use; its `texture` arrays hold indices into this."""

_GRAVEL, _BRICK = TEXTURES.index("gravel"), TEXTURES.index("brick")


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
    """(n,) indices into TEXTURES."""

    def __post_init__(self) -> None:
        for f in fields(self):
            getattr(self, f.name).setflags(write=False)

    def __len__(self) -> int:
        return len(self.yaw)

    @property
    def footprint_radius(self) -> Array:
        """(n,) radius of the circle around each box seen from above, m."""
        return np.hypot(self.half_extents[:, 0], self.half_extents[:, 1])


def join(*parts: Boxes) -> Boxes:
    """The boxes of all parts, in order."""
    return Boxes(
        *(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Boxes))
    )


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """A flat ground at height zero with solid boxes on it, and where the robot starts."""

    name: str
    solids: Boxes
    """Everything that stands on the ground: obstacles first, then the walls."""
    n_walls: int
    ground_half_size: float
    """The ground is a square of twice this side around the world's origin, m."""
    ground_texture: int
    start: Array
    """(3,) pose at which the robot starts: x [m], y [m], heading [rad]."""
    clear_radius: float
    """The robot's centre may be driven anywhere within this of the start and touch nothing, m."""


def world_names() -> list[str]:
    """Names that `make_world` accepts."""
    return sorted(_GENERATORS)


def make_world(name: str, rng: np.random.Generator) -> World:
    """A new world of the named kind.

    Raises:
        ValueError: no kind of world has that name; the message lists those there are.
    """
    if name not in _GENERATORS:
        near = difflib.get_close_matches(str(name), _GENERATORS, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise ValueError(f"no world is named {name!r}; {hint}known: {', '.join(world_names())}")
    return _GENERATORS[name](rng)


# --- yard ----------------------------------------------------------------------------------------

_HALF_SIZE = 9.0  # m, from the centre to the inner face of a wall
_N_OBSTACLES = 40
_CLEAR_RADIUS = 3.5
_ROBOT_RADIUS = 0.4  # of the circle around the robot seen from above, rounded up
_SMALLEST, _LARGEST = (0.12, 0.12, 0.10), (0.50, 0.50, 0.90)


def _yard(rng: np.random.Generator) -> World:
    """A walled gravel yard, 18 x 18 m, with 40 boxes strewn around a clear place in its middle."""
    start = np.append(rng.uniform(-1.5, 1.5, 2), rng.uniform(-np.pi, np.pi))
    start.setflags(write=False)
    walls = _walls(_HALF_SIZE, thickness=0.3, height=2.5)
    obstacles = _strewn_boxes(rng, start[:2], _CLEAR_RADIUS + _ROBOT_RADIUS)
    return World(
        name="yard",
        solids=join(obstacles, walls),
        n_walls=len(walls),
        ground_half_size=_HALF_SIZE + 0.3,
        ground_texture=_GRAVEL,
        start=start,
        clear_radius=_CLEAR_RADIUS,
    )


def _walls(half_size: float, *, thickness: float, height: float) -> Boxes:
    """Four walls around a square; those along x close the corners."""
    reach, half = half_size + thickness / 2, thickness / 2
    centre = [[reach, 0], [-reach, 0], [0, reach], [0, -reach]]
    extents = [[half, half_size]] * 2 + [[half_size + thickness, half]] * 2
    return Boxes(
        centre=np.column_stack([centre, np.full(4, height / 2)]),
        half_extents=np.column_stack([extents, np.full(4, height / 2)]),
        yaw=np.zeros(4),
        texture=np.full(4, _BRICK),
    )


def _strewn_boxes(rng: np.random.Generator, start: ArrayLike, clearance: float) -> Boxes:
    """Boxes that touch neither each other nor the place around the start."""
    positions: list[Array] = [np.asarray(start, dtype=np.float64)]
    radii: list[float] = [clearance]
    half_extents = rng.uniform(_SMALLEST, _LARGEST, (_N_OBSTACLES, 3))
    for half in half_extents:
        radius = float(np.hypot(half[0], half[1]))
        positions.append(_free_position(rng, radius, np.array(positions), np.array(radii)))
        radii.append(radius)
    return Boxes(
        centre=np.column_stack([np.array(positions[1:]), half_extents[:, 2]]),
        half_extents=half_extents,
        yaw=rng.uniform(-np.pi, np.pi, _N_OBSTACLES),
        texture=rng.integers(_BRICK, len(TEXTURES), _N_OBSTACLES),
    )


def _free_position(
    rng: np.random.Generator, radius: float, taken: Array, taken_radii: Array
) -> Array:
    """A place for a circle that overlaps no taken one (at most a third of the yard is taken)."""
    reach = _HALF_SIZE - radius
    while True:
        candidates = rng.uniform(-reach, reach, (16, 2))
        distance = np.linalg.norm(candidates[:, None] - taken, axis=-1)
        free = np.flatnonzero(np.all(distance > taken_radii + radius, axis=1))
        if free.size:
            return np.asarray(candidates[free[0]])


_GENERATORS: dict[str, Callable[[np.random.Generator], World]] = {"yard": _yard}
