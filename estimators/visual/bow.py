"""How far disparities bow towards the image's edge: what neither calibration nor rows tell.

A yaw between the eyes moves what the right one sees along the rows by x^2, a decentering of its
lens by 3 x^2 + y^2; across the rows both by x y. What of the two does not cancel along x moves
points by x^2 + y^2. No rigid motion maps a bowed world onto itself, so moving points tell of it.
"""

from dataclasses import dataclass

from grouser.geometry import Array


@dataclass(frozen=True, slots=True)
class Bow:
    """By how much less disparity is measured half the image's width from the middle."""

    px: float
    sigma: float
    """px"""


NO_BOW = Bow(0.0, 0.0)
"""Of a pair as good as its calibration."""


@dataclass(frozen=True, slots=True)
class Bowed:
    """How the disparities of matched points hang on the bow."""

    reference: Array
    """(n,) their derivative by it in the reference frame"""
    current: Array
    """(n,)"""
    bow: Bow
    """As it is taken out of them already."""


class BowFit:
    """The mean of what keyframes say, of which old ones are forgotten."""

    def __init__(self) -> None:
        self._information = self._pull = 0.0

    def estimate(self, spread: float) -> Bow:
        """As known by now, where one as large as `spread` [px] would be no wonder."""
        if spread <= 0:
            return NO_BOW
        information = self._information + spread**-2
        return Bow(self._pull / information, information**-0.5)

    def learn(self, seen: Bow, known: Bow) -> None:
        """From a keyframe's points alone, beside what is known."""
        variance = (_NEIGHBOURS * seen.sigma) ** 2 + _COMMON**2
        off = abs(seen.px - known.px) / (variance + known.sigma**2) ** 0.5
        weight = 1 / (variance * max(1.0, off / _OUTLIER))
        self._information = _MEMORY * self._information + weight
        self._pull = _MEMORY * self._pull + weight * seen.px


_NEIGHBOURS = 2.0  # what points share makes a keyframe's sigma larger than their scatter says
_COMMON = 0.1  # px, of one keyframe: what its points have in common
_OUTLIER = 3.0  # sigmas beyond which a keyframe's weight falls
_MEMORY = 0.98  # of what was known, a keyframe later: a rectification drifts with the temperature
