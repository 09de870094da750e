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
    measured = Increment(np.array(pose), np.eye(3), np.zeros((3, 0)))
    assert contradicted(np.array(step), measured) is expected
    guessed = Increment(np.array(pose), np.eye(3), np.zeros((3, 0)), measured=False)
    assert not contradicted(np.array(step), guessed)
