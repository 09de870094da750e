"""Features are the same for one observation and for many, and the same as in training."""

import numpy as np
import pytest
from gymnasium import spaces

from grouser.agents.learning.features import features, n_features
from grouser.agents.navigation import GoalNavEnv


def space(**options: object) -> spaces.Dict:
    env = GoalNavEnv(robot={"dynamics": "fast"}, **options)  # type: ignore[arg-type]
    env.close()
    return env.observation_space


def test_many_at_a_time_are_each_by_itself() -> None:
    shown = [space(covariance=True).sample() for _ in range(5)]
    batch = {key: np.stack([one[key] for one in shown]) for key in shown[0]}
    np.testing.assert_array_equal(features(batch), [features(one) for one in shown])


def test_they_are_finite_and_tame() -> None:
    """Even of a goal a thousand kilometres off, and of a variance of as much."""
    view = space(covariance=True)
    for bound in ("low", "high"):
        extreme = {key: getattr(part, bound) for key, part in view.spaces.items()}
        values = features(extreme)
        assert np.isfinite(values).all() and np.abs(values).max() <= 10
        assert len(values) == n_features(view)


def test_differences_close_by_stand_out() -> None:
    shown = space().sample()

    def change(beam: float) -> float:
        near, farther = ({**shown, "beams": np.full(36, beam + d)} for d in (0.0, 0.01))
        return float(np.abs(features(farther) - features(near)).max())

    assert change(0.03) > 5 * change(0.5)


def test_images_are_refused() -> None:
    with pytest.raises(ValueError, match=r"shows \['beams', 'goal', 'last_action', 'left'\]: make"):
        n_features(space(policy_sensors=("lidar", "left")))
