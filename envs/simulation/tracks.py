"""Two tracks: their measures, and where they touch the ground."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from grouser.checks import require_positive, require_whole
from grouser.geometry import Array

GRAVITY: Final = 9.81
"""m/s^2"""


@dataclass(frozen=True, slots=True)
class TrackModel:
    """Two equal tracks, or two rows of wheels that are driven as tracks are (skid steering)."""

    gauge: float = 0.40
    """Distance between the centre lines, m."""
    width: float = 0.08
    """Width of one track, m."""
    contact_length: float = 0.50
    """Length on the ground of a track, or of each wheel, m."""
    sinkage: float = 0.004
    """How far the ground gives under the robot's weight at rest, m."""
    damping_ratio: float = 0.5
    """Of the ground, up and down."""
    n_patches: int = 8
    """Patches along each contact length."""
    approach: tuple[tuple[float, float], ...] = ((0.035, 0.012), (0.065, 0.050))
    """Raised patches beyond either end: how far beyond and how high above the sole, m. They bear
    only when the robot pitches or the ground rises."""
    axles: tuple[float, ...] = ()
    """Where the wheels of a side stand ahead of its middle, m; none for a track, which bears along
    its whole length."""
    lateral_factor: float = 1.0
    """Force across over force along the track for the same shear: 1 for flat shoes, more for tyres
    and shoes that dig in and push a wall of soil sideways (lateral bulldozing)."""

    def __post_init__(self) -> None:
        require_positive(self, "gauge", "width", "contact_length", "sinkage", "lateral_factor")
        require_whole(self, "n_patches")
        if self.n_patches < 2:
            raise ValueError("TrackModel.n_patches must be at least 2, the ends of the contact")

    def patches(self) -> tuple[Array, Array, NDArray[np.int64]]:
        """Along (n,) and above (n,) of one side's patches, m, from the middle of its sole, and the
        contact (n,) that each belongs to; in each contact the rearmost first."""
        half = self.contact_length / 2
        beyond, above = np.array(self.approach).T
        flat = np.linspace(-half, half, self.n_patches)
        x = np.concatenate([-half - beyond[::-1], flat, half + beyond])
        z = np.concatenate([above[::-1], np.zeros(self.n_patches), above])
        middles = self.axles or (0.0,)
        return (
            np.concatenate([middle + x for middle in middles]),
            np.tile(z, len(middles)),
            np.repeat(np.arange(len(middles)), len(x)),
        )

    @property
    def spacing(self) -> float:
        """Between neighbouring patches of a contact, m."""
        return self.contact_length / (self.n_patches - 1)

    def ground_stiffness(self, mass: float) -> tuple[float, float]:
        """Spring [N/m] and damper [N s/m] under each patch."""
        n = 2 * self.n_patches * max(1, len(self.axles))
        spring = mass * GRAVITY / n / self.sinkage
        return spring, self.damping_ratio * 2 * math.sqrt(spring * mass / n)
