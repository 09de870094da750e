"""Vision that stands while the tracks move is noticed, and slip in part is not taken for it."""

import numpy as np
import pytest

from grouser.estimators.visual.prediction import Increment
from grouser.estimators.visual.stillness import contradicted


@pytest.mark.parametrize(
    ("step", "pose", "expected"),
    [
        ([0.0, 0.0, 0.0], [0.04, 0.0, 0.0], True),
        ([0.001, 0.001, 0.001], [0.04, 0.0, 0.05], True),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.05], True),
        ([0.01, 0.0, 0.0], [0.04, 0.0, 0.0], False),
        ([0.0, 0.0, 0.02], [0.04, 0.0, 0.05], False),
        ([0.0, 0.0, 0.0], [0.005, 0.0, 0.01], False),
    ],
)
def test_rest_against_motion(step: list[float], pose: list[float], expected: bool) -> None:
    sure = 1e-6 * np.eye(3)
    measured = Increment(np.array(pose), sure, np.zeros((3, 0)))
    assert contradicted(np.array(step), sure, measured) is expected
    guessed = Increment(np.array(pose), sure, np.zeros((3, 0)), measured=False)
    assert not contradicted(np.array(step), sure, guessed)


@pytest.mark.parametrize(("sigma", "expected"), [(0.002, True), (0.004, False)])
def test_a_short_step_may_be_lost_in_the_noise(sigma: float, expected: bool) -> None:
    """12 mm that look like 1 mm are 2.8 sigma of 4 mm, which happens, and 5.5 of 2 mm."""
    noise = np.diag([sigma, sigma, 1e-3]) ** 2
    measured = Increment(np.array([0.012, 0.0, 0.0]), 1e-9 * np.eye(3), np.zeros((3, 0)))
    assert contradicted(np.array([0.001, 0.0, 0.0]), noise, measured) is expected


def test_half_turns_are_not_mistaken_for_rest() -> None:
    """A heading that wraps is near."""
    sure = 1e-6 * np.eye(3)
    measured = Increment(np.array([0.0, 0.0, np.pi]), sure, np.zeros((3, 0)))
    assert not contradicted(np.array([0.0, 0.0, -np.pi]), sure, measured)
