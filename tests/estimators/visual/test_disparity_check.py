"""The filter believes the rig until keyframes contradict it, and then them."""

import numpy as np
import pytest

from grouser.estimators.visual.constant_errors import NO_ERRORS
from grouser.estimators.visual.disparity_check import DisparityCheck
from grouser.estimators.visual.fusion import RelativeFilter, RelativePose
from grouser.estimators.visual.structure import OffsetEvidence

VISION = np.diag([0.002, 0.002, 0.001]) ** 2
AHEAD = np.array([0.25, 0.0, 0.0])


def driven(offset: float, *, sigma: float, keyframes: int = 40) -> tuple[RelativeFilter, float]:
    """A drive straight ahead of which every keyframe shows the offset [px]; and what was said.

    A pixel makes all distances five per cent too long.
    """
    kalman, check = RelativeFilter(NO_ERRORS, disparity_sigma=sigma), DisparityCheck()
    rng, by_disparity = np.random.default_rng(0), 0.05 * AHEAD
    for _ in range(keyframes):
        seen = RelativePose(AHEAD + offset * by_disparity, VISION, by_disparity)
        kalman.commit(kalman.follow(seen, 5))
        check.take(OffsetEvidence(offset + 0.05 * rng.normal(), 0.02), kalman)
    return kalman, check.diagnostics["disparity_suspect"]


def test_an_offset_that_the_rig_denies_is_taken_out_of_the_whole_way() -> None:
    kalman, suspect = driven(0.8, sigma=0.02)
    assert suspect == 1.0
    assert kalman.offset()[0] == pytest.approx(0.8, abs=0.05)
    assert kalman.keyframe.pose[0] == pytest.approx(10.0, abs=0.03)
    assert np.sqrt(kalman.keyframe.covariance[0, 0]) == pytest.approx(0.02, abs=0.015)


def test_a_rig_that_is_right_is_believed() -> None:
    kalman, suspect = driven(0.0, sigma=0.02)
    assert suspect == 0.0
    assert abs(kalman.offset()[0]) < 0.02 and kalman.keyframe.pose[0] == pytest.approx(10, abs=0.01)


def test_a_rig_that_does_not_know_is_told() -> None:
    kalman, suspect = driven(0.3, sigma=0.5)
    assert suspect == 1.0
    assert kalman.offset()[0] == pytest.approx(0.3, abs=0.05)


def test_without_evidence_nothing_changes_and_nothing_is_claimed() -> None:
    kalman, check = RelativeFilter(NO_ERRORS, disparity_sigma=0.02), DisparityCheck()
    before = kalman.keyframe
    check.take(None, kalman)
    assert kalman.keyframe is before
    assert check.diagnostics["disparity_suspect"] == 0.0
    assert np.isnan(check.diagnostics["disparity_offset_px"])
