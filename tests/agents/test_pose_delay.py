"""A late estimate is the one that was due: the newest whose stamp is at least the latency ago."""

import numpy as np
import pytest

from grouser.agents.pose_delay import PoseDelay
from grouser.estimators.base import PoseEstimate, Status


def estimate(stamp: float) -> PoseEstimate:
    return PoseEstimate(np.zeros(3), np.zeros((3, 3)), Status.TRACKING, stamp)


@pytest.mark.parametrize(
    ("latency", "behind"), [(0.0, 0), (0.05, 1), (0.1, 1), (0.25, 3), (0.3, 3)]
)
def test_estimates_arrive_after_the_latency_and_not_before(latency: float, behind: int) -> None:
    delay = PoseDelay(latency)
    first = delay.reset(estimate(0.0))
    assert first.stamp == 0.0
    for k in range(1, 200):
        arrived = delay.arrived(estimate(k * 0.1), k * 0.1)
        assert arrived.stamp == pytest.approx(0.1 * max(k - behind, 0))


def test_a_new_episode_forgets_what_was_under_way() -> None:
    delay = PoseDelay(0.3)
    delay.reset(estimate(0.0))
    for k in range(1, 3):
        delay.arrived(estimate(k * 0.1), k * 0.1)
    again = delay.reset(estimate(0.0))
    assert all(delay.arrived(estimate(k * 0.1), k * 0.1) is again for k in range(1, 3))


@pytest.mark.parametrize("latency", [-0.1, float("inf"), float("nan")])
def test_a_latency_that_is_none_is_refused(latency: float) -> None:
    with pytest.raises(ValueError, match="pose_latency must be 0 s or more, and finite, got"):
        PoseDelay(latency)
