"""Checks the disparities at every keyframe, and tells the filter when the rig is contradicted."""

import numpy as np

from grouser.estimators.visual.offset_watch import OffsetEstimate, OffsetWatch
from grouser.estimators.visual.pose_filter import PoseFilter
from grouser.estimators.visual.structure import OffsetEvidence

_COMMON = 0.1  # px, of one keyframe: what its points have in common
_NEIGHBOURS = 2.0  # what points share makes a keyframe's sigma larger than their scatter says
_GATE = 4.0
"""Sigmas. A keyframe beyond is left out; where all of them together are beyond, what the filter
believes of the disparities is wrong, not they."""


class DisparityCheck:
    """What structure says of the disparity offset, beside what the filter believes of it."""

    def __init__(self) -> None:
        self._watch = OffsetWatch()
        self._together: OffsetEstimate | None = None

    def take(self, evidence: OffsetEvidence | None, kalman: PoseFilter) -> None:
        """One more keyframe's evidence, if it has any, for the filter's keyframe."""
        if evidence is None:
            return
        self._watch.add(evidence)
        believed, sigma = kalman.offset()
        self._together = together = self._watch.estimate
        if together is not None:
            beyond = abs(together.offset - believed)
            if beyond > _GATE * np.hypot(together.sigma, sigma):
                kalman.doubt_offset(beyond)
                kalman.observe_offset(together.offset, together.sigma)
                return
        own = float(np.hypot(_NEIGHBOURS * evidence.sigma, _COMMON))
        if abs(evidence.offset - believed) < _GATE * np.hypot(own, sigma):
            kalman.observe_offset(evidence.offset, own)

    @property
    def diagnostics(self) -> dict[str, float]:
        """NaN until a few keyframes are seen."""
        estimate = self._together
        if estimate is None:
            return {
                "disparity_offset_px": np.nan,
                "disparity_offset_sigma_px": np.nan,
                "disparity_suspect": 0.0,
            }
        return {
            "disparity_offset_px": estimate.offset,
            "disparity_offset_sigma_px": estimate.sigma,
            "disparity_suspect": float(estimate.suspect),
        }
