"""What the robot is: masses, measures, motors."""

from dataclasses import dataclass, field

import numpy as np

from grouser.checks import require_positive
from grouser.envs.simulation.tracks import TrackModel
from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class RobotModel:
    """A small tracked robot of the size of a Husky's little brother."""

    mass: float = 40.0
    """kg"""
    length: float = 0.60
    """m, of the hull, which alone collides with boxes and walls."""
    hull_width: float = 0.48
    """m, over the tracks."""
    hull_bottom: float = 0.12
    """m above the ground at rest; lower things pass under the hull."""
    hull_top: float = 0.22
    com_height: float = 0.086
    """Centre of mass above the robot's origin, which lies on the ground at rest, m."""
    inertia: tuple[float, float, float] = (0.81, 1.33, 1.88)
    """About the centre of mass, kg m^2: a block of 0.60 x 0.45 x 0.20 m."""
    top_speed: float = 0.5
    """Of a track, m/s."""
    motor_lag: float = 0.1
    """Time constant with which a track follows its command, s."""
    tracks: TrackModel = field(default_factory=TrackModel)

    def __post_init__(self) -> None:
        require_positive(self, "mass", "length", "hull_width", "com_height", "motor_lag")
        if not 0 < self.hull_bottom < self.hull_top:
            raise ValueError(
                f"RobotModel.hull_bottom must be above 0 and below hull_top, {self.hull_top} m, "
                f"got {self.hull_bottom} m"
            )

    @property
    def hull(self) -> tuple[Array, Array]:
        """Centre and half extents (3,) of the hull, robot frame, m."""
        top, bottom = self.hull_top, self.hull_bottom
        centre = np.array([0, 0, (top + bottom) / 2])
        return centre, np.array([self.length, self.hull_width, top - bottom]) / 2

    def hull_points(self) -> Array:
        """(19, 3) where the hull may strike the ground, robot frame, m: its corners and a grid over
        its belly."""
        centre, half = self.hull
        belly = [[x, y, -1.0] for x in (-1.0, 0.0, 1.0) for y in (-1.0, -0.5, 0.0, 0.5, 1.0)]
        top = [[x, y, 1.0] for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
        return np.asarray(centre + half * np.array(belly + top))
