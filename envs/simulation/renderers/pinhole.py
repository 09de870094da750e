"""The camera that every renderer looks through."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pinhole:
    """An ideal camera; pixel centres are at integers."""

    width: int
    height: int
    fx: float
    """px"""
    fy: float
    cx: float
    cy: float

    @staticmethod
    def with_field_of_view(width: int, height: int, horizontal: float) -> "Pinhole":
        """Square pixels, the principal point in the middle; horizontal field of view in rad."""
        f = width / 2 / math.tan(horizontal / 2)
        return Pinhole(width, height, f, f, (width - 1) / 2, (height - 1) / 2)
