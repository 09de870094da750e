"""A keyframe is replaced when it goes out of view, and not because of one blurred frame."""

import numpy as np
import pytest

from grouser.estimators.visual.keyframes import KeyframeRule
from grouser.estimators.visual.sight import Sight

HERE = np.zeros(3)
RULE = KeyframeRule()


def sight(inliers: int = 60, candidates: int = 200) -> Sight:
    diagnostics = {"inliers": float(inliers), "candidates": float(candidates)}
    return Sight(np.zeros(6), np.eye(6), np.zeros(6), diagnostics)


BLIND = Sight(None, np.zeros((6, 6)), np.zeros(6), {"inliers": 0.0, "candidates": 0.0})


def test_at_rest_with_a_good_view_it_stays_until_its_last_frame() -> None:
    assert not RULE.replaces(HERE, sight(), frames=59, failures=0)
    assert RULE.replaces(HERE, sight(), frames=60, failures=0)


@pytest.mark.parametrize(
    "pose", [[0.26, 0, 0], [-0.26, 0, 0], [0.18, 0.18, 0], [0, 0, 0.21], [0, 0, -0.21]]
)
def test_a_way_or_a_turn_too_far_replaces_it_even_in_the_dark(pose: list[float]) -> None:
    for seen in (sight(), BLIND):
        assert RULE.replaces(np.array(pose), seen, frames=1, failures=0)
        assert not RULE.replaces(0.9 * np.array(pose), seen, frames=1, failures=0)


def test_few_inliers_or_few_features_in_view_replace_it() -> None:
    assert not RULE.replaces(HERE, sight(inliers=27, candidates=64), frames=1, failures=0)
    assert RULE.replaces(HERE, sight(inliers=26), frames=1, failures=0)
    assert RULE.replaces(HERE, sight(candidates=63), frames=1, failures=0)


def test_only_a_lasting_blackout_replaces_it() -> None:
    assert not RULE.replaces(HERE, BLIND, frames=5, failures=2)
    assert RULE.replaces(HERE, BLIND, frames=5, failures=3)
