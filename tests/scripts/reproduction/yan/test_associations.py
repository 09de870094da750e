"""Wrong associations are counted by the truth, and there are some where there must be some."""

from typing import Any

import numpy as np
import pytest

from grouser.estimators.line_slam.estimator import EkfLineSlam
from grouser.estimators.line_slam.lines import lines_in_frame
from grouser.geometry import Array
from grouser.scripts.reproduction.yan.associations import Associations
from grouser.scripts.reproduction.yan.drives import line_world, rig_of
from grouser.scripts.reproduction.yan.forms import CORRECTED, FORMS, RIVALS
from grouser.scripts.reproduction.yan.monte_carlo import MonteCarlo

TRUE = np.array([[20.0, 0.0], [20.0, 1.5], [20.0, 3.0], [20.0, -1.5]])
POSE = np.array([3.0, -2.0, 0.4])


class Scripted(EkfLineSlam):
    """Takes lines for what it is told."""

    told: tuple[Array, Array]

    @property
    def matches(self) -> tuple[Array, Array]:
        return self.told


@pytest.mark.parametrize(("taken_for", "wrong"), [([0, 1, 3], 0), ([0, 2, 3], 1), ([1, 0, 2], 3)])
def test_what_was_taken_for_another_line_is_wrong(taken_for: list[int], wrong: int) -> None:
    env = line_world("yan-normal", sensors=("steering", "lines"))
    scripted = Scripted(rig_of(env))
    looks = Associations({"scripted": scripted})
    off = np.array([0.4, 0.02])
    scripted.told = TRUE[taken_for] + off, lines_in_frame(TRUE[[0, 1, 3]], POSE) - off
    looks.note()
    scripted.told = np.zeros((0, 2)), np.zeros((0, 2))
    looks.note()
    assert looks.counts("scripted", TRUE, np.array([POSE, POSE])) == (3, wrong)


@pytest.mark.parametrize(
    ("world", "form"),
    [
        ("yan-normal", FORMS[CORRECTED]),
        ("yan-over-range", FORMS[CORRECTED]),
        ("yan-normal", RIVALS["scan"]),
        ("yan-normal", RIVALS["scan-lidar"]),
    ],
)
def test_the_filter_takes_no_line_for_another(world: str, form: Any) -> None:
    drives = MonteCarlo("test", world, {"form": form}, (0,)).run(lambda: None)
    assert drives["form.wrong"].tolist() == [0.0]
    assert drives["form.associations"].min() > 300
    np.testing.assert_array_equal(drives["form.associations"], drives["form.matched"].sum(axis=1))
