"""Odometry and a known distance give back the offset that made the legs too long."""

import numpy as np
import pytest

from grouser.estimators.visual.engine import Leg
from grouser.estimators.visual.fusion import RelativePose
from grouser.estimators.visual.offset_calibration import (
    Distance,
    Odometry,
    by_distance,
    by_odometry,
    by_structure,
    combined,
)
from grouser.estimators.visual.offset_watch import OffsetEstimate
from grouser.geometry import Array, compose

OFFSET, PER_PIXEL = 0.4, 0.08
STEP = np.array([0.25, 0.02, 0.05])
VISION = np.diag([1e-3, 1e-3, 1e-3]) ** 2


def drive(n: int = 40, *, blind: int | None = None) -> tuple[list[Leg], Array]:
    """Legs on a curve, longer by a share a pixel of offset, and the true poses (n + 1, 3)."""
    poses, legs = [np.zeros(3)], [Leg(0.0, None, None)]
    by_offset = PER_PIXEL * np.append(STEP[:2], 0.0)
    seen = RelativePose(STEP + OFFSET * by_offset, VISION, by_offset)
    for index in range(1, n + 1):
        poses.append(compose(poses[-1], STEP))
        legs.append(Leg(0.5 * index, None if index == blind else seen, None))
    return legs, np.array(poses)


def known(poses: Array, scale: float = 1.0, sigma: float = 0.002) -> Odometry:
    poses = poses * [scale, scale, 1.0]
    return Odometry(np.arange(0.0, len(poses)) * 0.5, np.asarray(poses), sigma)


def test_odometry_gives_the_offset_as_surely_as_its_scale_allows() -> None:
    legs, poses = drive()
    found = by_odometry(legs, known(poses))
    assert found is not None
    assert found.offset == pytest.approx(OFFSET, abs=1e-6)
    assert found.sigma == pytest.approx(0.002 / PER_PIXEL, rel=0.1)
    wrong = by_odometry(legs, known(poses, scale=1.01))
    assert wrong is not None
    assert wrong.offset - OFFSET == pytest.approx(-0.01 / PER_PIXEL, rel=0.01)


def test_legs_without_vision_are_left_out_with_odometry_and_refused_with_a_distance() -> None:
    legs, poses = drive(blind=7)
    found = by_odometry(legs, known(poses))
    assert found is not None and found.offset == pytest.approx(OFFSET, abs=1e-6)
    with pytest.raises(ValueError, match=r"vision failed before 3\.5 s: a known distance needs"):
        by_distance(legs, Distance(5.0, 0.01))


def test_a_known_distance_gives_the_offset() -> None:
    legs, poses = drive()
    metres = float(np.hypot(*poses[-1][:2]))
    found = by_distance(legs, Distance(metres, 0.01))
    assert found is not None
    assert found.offset == pytest.approx(OFFSET, abs=1e-6)
    assert 0.01 / (PER_PIXEL * metres) < found.sigma < 0.05


def test_what_tells_nothing_is_no_estimate() -> None:
    still = [Leg(0.0, None, None), Leg(1.0, RelativePose(np.zeros(3), VISION, np.zeros(3)), None)]
    poses = np.zeros((2, 3))
    assert by_odometry(still, known(poses)) is None
    assert by_distance(still, Distance(1.0, 0.01)) is None
    assert by_structure(still) is None
    with pytest.raises(ValueError, match="nothing on this drive tells of the disparity offset: it"):
        combined([None, None])


def test_estimates_are_combined_by_how_sure_they_are() -> None:
    both = combined([OffsetEstimate(0.0, 0.1), None, OffsetEstimate(1.0, 0.2)])
    assert both.offset == pytest.approx(0.2)
    assert both.sigma == pytest.approx((100 + 25) ** -0.5)
