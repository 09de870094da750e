"""How a pair's eyes differ beside their baseline: what rectification left, learnt on the way.

A calibration undoes the lenses and the mount of each eye. What it leaves of a pitch, a roll, a yaw,
a focal length, a decentering and a radial distortion between them (Brown 1966) moves what the right
eye sees by a field of a few terms. Across the rows it shows in the matches themselves; half a pixel
of rows spoils no match, but is taken for disparity wherever texture is slanted. The same terms move
it along the rows, where they pass for disparity and bend the world: on a recording of KITTI's, with
a pixel and a half of rows in the corners, by half a pixel.

Two of them look alike across the rows, as x y: a yaw, and a decentering along. Calibrations see
what moves points along the rows, so the two are first taken to cancel there; by how much they do
not is the bow (`bow`).
"""

from dataclasses import dataclass

import numpy as np

from grouser.estimators.visual.bow import NO_BOW, Bow, BowFit
from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class EyeDifference:
    """How far from its place the right eye sees what the left sees at a place."""

    coefficients: Array
    """(6,) px of pitch, roll, focal length, yaw with decentering along, decentering across and
    radial distortion, of the right eye less the left; places are in half widths of the image"""
    told: float
    """What share of them is not chance: of a pair as good as its calibration, none."""
    bow: Bow
    """What the rows do not tell."""
    half: Array
    """(2,) half the image's width and height, px"""
    focal: float
    """Focal length, half widths of the image"""

    def rows_at(self, points: Array) -> Array:
        """(n,) px, by how much lower the right eye sees points (n, 3) u, v, d."""
        lower = self.across(*self.places(points)) @ self.coefficients
        return np.asarray(np.clip(lower, -_MOST, _MOST))

    def disparities_at(self, points: Array) -> Array:
        """(n,) px, by how much more disparity is measured at points (n, 3) u, v, d than is."""
        x, y = self.places(points)
        pitch, roll, focal, yaw, across, radial = self.told * self.coefficients
        both = pitch / self.focal**2 + 2 * across
        right = x * (focal + both * y + radial * (x * x + y * y)) - y * (roll + yaw * y)
        more = self.bow.px * self.bowed_at(points) - right
        return np.asarray(np.clip(more, -_MOST, _MOST))

    def bowed_at(self, points: Array) -> Array:
        """(n,) the derivative of `disparities_at` by the bow."""
        x, y = self.places(points)
        return np.asarray(-(x * x + y * y))

    def across(self, x: Array, y: Array) -> Array:
        """(n, 6) the derivative of rows at places by the coefficients."""
        pitch, radial = 1 + (y / self.focal) ** 2, x * x + y * y
        return np.column_stack([pitch, x, y, x * y, radial + 2 * y * y, y * radial])

    def places(self, points: Array) -> tuple[Array, Array]:
        """(n,) x and y where the right eye sees points (n, 3) u, v, d, in half widths from the
        middle of the image."""
        u, v, d = points.T
        return (u - d - self.half[0]) / self.half[0], (v - self.half[1]) / self.half[0]


class EyeDifferenceFit:
    """Least squares over the keyframes, of which old ones are forgotten, against wrong matches."""

    def __init__(self, focal: float) -> None:
        """focal: length, half widths of the image."""
        self._focal = focal
        self._information, self._vector = np.zeros((6, 6)), np.zeros(6)
        self.coefficients: Array = np.zeros(6)
        """(6,) as of `EyeDifference`"""
        self.bow = BowFit()

    @property
    def empty(self) -> bool:
        """Whether nothing was learnt yet."""
        return not self._information.any()

    def difference(self, shape: tuple[int, int]) -> EyeDifference:
        """As known by now, for images (H, W)."""
        height, width = shape
        told = self._told()
        bow = self.bow.estimate(told * abs(self.coefficients[_YAW])) if told else NO_BOW
        return EyeDifference(
            self.coefficients, told, bow, np.array([width, height]) / 2, self._focal
        )

    def learn(self, lower: Array, texture: Array, points: Array, eyes: EyeDifference) -> None:
        """One keyframe's points (n, 3), how much lower each is seen [px], and how sure that is.

        Args:
            texture: (n,) squared grey levels a px; zero says nothing.
            eyes: as they were known, for the image's size.
        """
        telling = np.flatnonzero(np.nan_to_num(texture) > 0)
        telling = telling[:: 1 + len(telling) // _ENOUGH]
        if len(telling) == 0:
            return
        H, seen = eyes.across(*eyes.places(points[telling])), lower[telling]
        corner = eyes.across(np.ones(1), eyes.half[1:] / eyes.half[0])[0]
        prior = np.diag((corner / _PRIOR) ** 2)
        variances = _OWN**2 + _GREY_NOISE**2 / texture[telling]
        before, vector = _MEMORY * self._information, _MEMORY * self._vector
        x: Array = self.coefficients
        for _ in range(_ROUNDS):
            errors = (seen - H @ x) ** 2 / variances
            # Were all far off, what was known would be, not they.
            scale = max(1.0, float(np.median(errors)) / _MEDIAN_ERROR)
            weights = 1 / (variances * (scale + errors / _CAUCHY**2))
            now, pull = H.T * weights @ H, H.T @ (weights * seen)
            x = np.asarray(np.linalg.solve(before + now + prior, vector + pull))
        self._information, self._vector, self.coefficients = before + now, vector + pull, x

    def _told(self) -> float:
        """What share of the coefficients is not chance."""
        squared_sigmas = float(self.coefficients @ self._information @ self.coefficients)
        return max(0.0, 1 - _CHANCE / squared_sigmas) if squared_sigmas > 0 else 0.0


_YAW = 3
_MOST = 3.0  # px: pairs that are farther off are not rectified
_PRIOR = 0.5  # px, of each term, in a corner of the image
_OWN = 0.1  # px, of an aligned row
_GREY_NOISE = 5.0  # grey levels
_MEDIAN_ERROR = 0.455  # chi-square of 1 degree of freedom
_CAUCHY = 2.0  # sigmas at which a point's weight has fallen
_CHANCE = 22.5  # chi-square of 6 degrees of freedom at 99.9 %
_ROUNDS = 3
_ENOUGH = 300  # points of a keyframe: more cost time, and say the same
_MEMORY = 0.9  # of what was known, a keyframe later: a rectification drifts with the temperature
