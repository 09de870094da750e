"""Which pairs are believed: the largest joint set, and nothing that has a rival."""

import numpy as np
from numpy.typing import NDArray

from grouser.estimators.line_slam.joint_compatibility import largest_joint_set
from grouser.geometry import Array

GATE, MARGIN = 13.3, 4.0
NOISE = np.diag([0.02, 0.01]) ** 2


def believed(
    seen: list[int], residuals: list[tuple[float, float]], pose: Array, margin: float = MARGIN
) -> list[bool]:
    """Of pairs whose residuals share an error of covariance `pose` (2, 2) for r and alpha."""
    k = len(seen)
    nu = np.array(residuals)
    noises = np.tile(NOISE, (k, 1, 1))
    d2 = np.einsum("ki,ij,kj->k", nu, np.linalg.inv(pose + NOISE), nu)
    out: NDArray[np.bool_] = largest_joint_set(
        np.array(seen, dtype=np.intp),
        nu,
        np.tile(pose, (k, k, 1, 1)),
        noises,
        d2 + float(np.log(np.linalg.det(pose + NOISE))),
        GATE,
        margin,
    )
    return [bool(one) for one in out]


WIDE = np.diag([0.5, 0.1]) ** 2


def test_two_that_agree_outvote_one_that_fits_better() -> None:
    """The first is turned the other way; alone it would be the likeliest."""
    pairs = [(0.0, 0.0), (0.3, 0.15), (0.31, 0.152)]
    assert believed([0, 1, 2], pairs, WIDE) == [False, True, True]


def test_a_pair_that_has_a_rival_is_left_out() -> None:
    """Two parallel walls half a metre apart: which of them it is, nobody knows."""
    assert believed([0, 0], [(0.2, 0.0), (-0.3, 0.0)], WIDE) == [False, False]
    assert believed([0, 0], [(0.2, 0.0), (-0.3, 0.0)], WIDE, margin=0.0) == [True, False]


def test_a_rival_that_others_contradict_is_none() -> None:
    seen, pairs = [0, 0, 1], [(0.2, 0.0), (-0.3, 0.0), (0.21, 0.0)]
    assert believed(seen, pairs, WIDE) == [True, False, True]


def test_two_lines_of_the_map_that_look_the_same_are_no_rivals() -> None:
    assert sum(believed([0, 0], [(0.2, 0.0), (0.21, 0.001)], WIDE)) == 1


def test_no_pairs() -> None:
    none = np.zeros((0, 2))
    out = largest_joint_set(
        np.zeros(0, dtype=np.intp),
        none,
        np.zeros((0, 0, 2, 2)),
        np.zeros((0, 2, 2)),
        np.zeros(0),
        GATE,
        MARGIN,
    )
    assert out.shape == (0,)
