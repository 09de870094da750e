"""How much of the images visual odometry looks at: one word for the options that cost time."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Quality:
    """What a front end seeks and what of it the estimation uses."""

    corners: int
    """Corners sought in each image."""
    max_points: int
    """Matched points that the estimation uses, spread over the image."""


QUALITIES = {
    "fast": Quality(corners=500, max_points=40),
    "standard": Quality(corners=900, max_points=64),
    "high": Quality(corners=2500, max_points=200),
}
"""By name. More corners find better ones, and more points average out what is independent between
them; what all points share (calibration, a disparity offset) is the same at any quality."""
