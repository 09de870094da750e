"""What stands on the plane and where a course leads: paper 2's two worlds, or any segments."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from grouser.checks import did_you_mean
from grouser.frozen import freeze, rebuilt
from grouser.geometry import Array, between


@dataclass(frozen=True, slots=True, eq=False)
class PlaneWorld:
    """Line landmarks on a plane, and a course between them."""

    name: str
    segments: Array
    """(n, 4) x and y of one end, x and y of the other, m."""
    start: Array
    """(3,) the vehicle's pose at the start: x, y [m], heading [rad]."""
    waypoints: Array
    """(m, 2) that a driver goes through, one after another, m; none where nobody said."""

    def __post_init__(self) -> None:
        freeze(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return rebuilt(self)

    @property
    def course(self) -> Array:
        """(m, 2) the waypoints in the frame of the start, m, as a driver there knows them."""
        return self.from_start(self.waypoints)

    @property
    def segments_from_start(self) -> Array:
        """(n, 4) the segments in the frame of the start, m: what a perfect map would say."""
        return self.from_start(self.segments.reshape(-1, 2)).reshape(-1, 4)

    def from_start(self, points: ArrayLike) -> Array:
        """(m, 2) points of the world in the frame of the start, m."""
        xy = np.asarray(points, dtype=np.float64)
        return between(self.start, np.column_stack([xy, np.zeros(len(xy))]))[:, :2]


def make_plane_world(
    world: str | ArrayLike, *, start: Sequence[float] | Array | None = None
) -> PlaneWorld:
    """A world by its name, or of segments.

    Args:
        world: one of PLANE_WORLDS, or (n, 4) segments [m].
        start: another pose at the start than the world's own; that of segments is zero.

    Raises:
        ValueError: a name that is not known, segments or a start that are not finite numbers of
            that shape.
    """
    made = _named(world) if isinstance(world, str) else _of_segments(world)
    return made if start is None else replace(made, start=_checked_start(start))


def _named(name: str) -> PlaneWorld:
    if name not in PLANE_WORLDS:
        raise ValueError(
            f"no plane world is named {name!r}; {did_you_mean(name, PLANE_WORLDS)}known: "
            f"{', '.join(sorted(PLANE_WORLDS))}; or give segments [[ax, ay, bx, by], ...]"
        )
    return PLANE_WORLDS[name]


def _of_segments(segments: ArrayLike) -> PlaneWorld:
    wanted = f"one of {', '.join(sorted(PLANE_WORLDS))}, or segments [[ax, ay, bx, by], ...] in m"
    try:
        ends = np.array(segments, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"world must be {wanted}, got {segments!r}") from error
    if ends.ndim != 2 or ends.shape[1] != 4 or not len(ends) or not np.isfinite(ends).all():
        raise ValueError(f"world must be {wanted}, finite and at least one, got {segments!r}")
    return PlaneWorld("segments", ends, np.zeros(3), np.zeros((0, 2)))


def _checked_start(start: Sequence[float] | Array) -> Array:
    pose = np.array(start, dtype=np.float64)
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise ValueError(f"start must be x, y [m] and heading [rad], finite, got {start!r}")
    return pose


def _yan(name: str, *, third_ends_at: float) -> PlaneWorld:
    """SPEC 2.0: four lines y = k x + c, over which x each of them runs, and one loop among them."""
    lines = (
        (2 / 3, 30.0, -30.0, 0.0),
        (-1.0, 20.0, 0.0, 20.0),
        (7 / 9, -35.0, 0.0, third_ends_at),
        (-0.7, -35.0, -60.0, 0.0),
    )
    segments = [(x0, k * x0 + c, x1, k * x1 + c) for k, c, x0, x1 in lines]
    waypoints = [(25.0, 0.0), (0.0, -20.0), (-35.0, 0.0), (-35.0, 10.0), (0.0, 35.0)]
    return PlaneWorld(name, np.array(segments), np.array([0.0, 35.0, 0.0]), np.array(waypoints))


PLANE_WORLDS: dict[str, PlaneWorld] = {
    "yan-normal": _yan("yan-normal", third_ends_at=45.0),
    "yan-over-range": _yan("yan-over-range", third_ends_at=60.0),
}
"""The worlds by name. In the second, the third line's end is farther off than the sensor sees."""
