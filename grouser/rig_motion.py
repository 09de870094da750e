"""What an estimator may know of how a robot moves without tracks, and of what shows it lines."""

from dataclasses import dataclass
from math import pi, radians

from grouser.checks import require_not_negative, require_positive, require_whole


@dataclass(frozen=True, slots=True)
class Steering:
    """A vehicle that steers with its front axle, the robot frame's origin (paper 2, eq. (5))."""

    wheelbase: float
    """From the rear axle to the front one, m."""
    max_speed: float
    """Of the front wheel, m/s."""
    max_angle: float
    """Of the front wheel, rad."""
    max_angle_rate: float
    """How fast it can be turned, rad/s."""
    sigma_speed: float
    """White noise of the reported speed, m/s."""
    sigma_angle: float
    """White noise of the reported angle, rad."""

    def __post_init__(self) -> None:
        require_positive(self, "wheelbase", "max_speed", "max_angle", "max_angle_rate")
        require_not_negative(self, "sigma_speed", "sigma_angle")
        if self.max_angle >= pi / 2:
            raise ValueError(
                f"Steering.max_angle must be less than a quarter turn, got {self.max_angle} rad"
            )


@dataclass(frozen=True, slots=True)
class Odometry:
    """How far pose increments that a robot worked out for itself may be off, one sigma of each.

    The defaults are wide enough for the odometry of real logs (SPEC 2.6), whose heading errs by
    several degrees a metre, the same way for long.
    """

    position: float = 0.05
    """Of x and of y, m."""
    position_per_metre: float = 0.05
    """Of x and of y, m per m."""
    heading: float = radians(0.7)
    """rad"""
    heading_per_metre: float = radians(5.0)
    """rad per m"""
    heading_per_radian: float = 0.15
    """rad per rad turned"""

    def __post_init__(self) -> None:
        require_not_negative(
            self,
            "position",
            "position_per_metre",
            "heading",
            "heading_per_metre",
            "heading_per_radian",
        )


@dataclass(frozen=True, slots=True)
class LineSensor:
    """Sees the ends of the visible parts of lines, all around the robot's origin (paper 2)."""

    range_max: float
    """m; a part of a line beyond it is invisible."""
    sigma_range: float
    """White noise of an end's distance, m."""
    sigma_bearing: float
    """White noise of an end's direction, rad."""
    max_lines: int
    """How many it reports at most, which is the length of the observation `lines`."""

    def __post_init__(self) -> None:
        require_positive(self, "range_max")
        require_not_negative(self, "sigma_range", "sigma_bearing")
        require_whole(self, "max_lines")
