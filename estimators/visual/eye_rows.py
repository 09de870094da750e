"""By how many rows the eyes differ: what rectification left, learnt from the matches themselves.

Rows of a rectified pair are the same by its calibration. By what is left of a pitch, a roll and a
yaw between the eyes, and of a difference of focal lengths, they differ by terms in 1, x, y and x y
of the place in the image. Half a pixel of it spoils no match, but is taken for disparity wherever
texture is slanted: on a recording of KITTI's, with a pixel in the corners, it is half of the drift
that is not the reference's own.
"""

from dataclasses import dataclass

import numpy as np

from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class EyeRows:
    """How much lower the right eye sees what the left sees at a place."""

    coefficients: Array
    """(4,) px, of 1, x, y and x y, where x and y are -1 and 1 at the left image's edges"""
    half: Array
    """(2,) half the image's width and height, px"""

    def at(self, points: Array) -> Array:
        """(n,) px, at points (n, >= 2) u, v of the left image."""
        lower = _terms(points, self.half) @ self.coefficients
        return np.asarray(np.clip(lower, -_MOST, _MOST))


class EyeRowsFit:
    """Least squares over the keyframes, of which old ones are forgotten, against wrong matches."""

    def __init__(self) -> None:
        self._information, self._vector = np.zeros((4, 4)), np.zeros(4)
        self.coefficients: Array = np.zeros(4)
        """(4,) as of `EyeRows`"""

    @property
    def empty(self) -> bool:
        """Whether nothing was learnt yet."""
        return not self._information.any()

    def rows(self, shape: tuple[int, int]) -> EyeRows:
        """As known by now, for images (H, W)."""
        height, width = shape
        return EyeRows(self.coefficients, np.array([width, height]) / 2)

    def learn(self, points: Array, lower: Array, texture: Array, half: Array) -> None:
        """One keyframe's points (n, >= 2), how much lower each is seen [px], and how sure that is.

        Args:
            texture: (n,) squared grey levels a px; zero says nothing.
        """
        telling = np.flatnonzero(np.nan_to_num(texture) > 0)
        telling = telling[:: 1 + len(telling) // _ENOUGH]
        H, seen = _terms(points[telling], half), lower[telling]
        variances = _OWN**2 + _GREY_NOISE**2 / texture[telling]
        before, vector = _MEMORY * self._information, _MEMORY * self._vector
        x: Array = self.coefficients
        for _ in range(_ROUNDS if len(telling) else 0):
            errors = (seen - H @ x) ** 2 / variances
            # Were all far off, what was known would be, not they.
            scale = max(1.0, float(np.median(errors)) / _MEDIAN_ERROR)
            weights = 1 / (variances * (scale + errors / _CAUCHY**2))
            now, pull = H.T * weights @ H, H.T @ (weights * seen)
            x = np.asarray(np.linalg.solve(before + now + np.diag(_PRIOR**-2), vector + pull))
        if len(telling):
            self._information, self._vector, self.coefficients = before + now, vector + pull, x


def _terms(points: Array, half: Array) -> Array:
    x, y = ((points[:, :2] - half) / half).T
    return np.column_stack([np.ones(len(x)), x, y, x * y])


_MOST = 3.0  # px: pairs that are farther off are not rectified
_PRIOR = np.full(4, 0.5)  # px
_OWN = 0.1  # px, of an aligned row
_GREY_NOISE = 5.0  # grey levels
_MEDIAN_ERROR = 0.455  # chi-square of 1 degree of freedom
_CAUCHY = 2.0  # sigmas at which a point's weight has fallen
_ROUNDS = 3
_ENOUGH = 300  # points of a keyframe: more cost time, and say the same
_MEMORY = 0.9  # of what was known, a keyframe later: a rectification drifts with the temperature
