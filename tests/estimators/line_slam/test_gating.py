"""Lines seen beside lines of the map, against dense algebra."""

import numpy as np
import pytest

from grouser.estimators.line_slam.gating import Candidates, candidates, cross_covariances
from grouser.estimators.line_slam.linearization import at, jacobian
from grouser.estimators.line_slam.lines import lines_in_frame, turned_over
from grouser.geometry import Array, wrap

POSE = np.array([1.5, -0.7, 0.6])
LINES = np.array([[3.0, 0.4], [-2.0, 2.0], [5.0, -2.5], [3.1, 0.45]])
MEAN = np.concatenate([POSE, LINES.ravel()])
R = np.array([[0.02, 0.001], [0.001, 0.004]])


@pytest.fixture(scope="module")
def P() -> Array:
    A = np.random.default_rng(1).normal(size=(11, 11)) * 0.05
    return np.asarray(A @ A.T + 1e-3 * np.eye(11))


def compare(P: Array, z: Array, *, gate: float = 9.21, two_sided: bool = False) -> Candidates:
    rows, beside = at(LINES[:, 1], POSE), np.ones((len(z), len(LINES)), dtype=np.bool_)
    noises = np.tile(R, (len(z), 1, 1))
    found = candidates(np.triu(P), MEAN, 3, rows, beside, z, noises, gate, two_sided)
    assert isinstance(found, Candidates)
    return found


def dense(P: Array, line: int, z: Array, noise: Array) -> tuple[float, float]:
    """d2 and its score, by the definition."""
    H = np.zeros((2, 11))
    H[:, [0, 1, 2, 3 + 2 * line, 4 + 2 * line]] = jacobian(at(LINES[line, 1:], POSE)[0])
    S = H @ P @ H.T + noise
    nu = z - lines_in_frame(LINES[line], POSE)
    nu[1] = wrap(nu[1])
    d2 = float(nu @ np.linalg.solve(S, nu))
    return d2, d2 + float(np.log(np.linalg.det(S)))


def test_every_pair_is_that_of_the_dense_filter(P: Array) -> None:
    z = lines_in_frame(LINES, POSE) + [0.05, 0.02]
    found = compare(P, z, gate=np.inf, two_sided=True)
    assert found.seen.tolist() == np.repeat(range(4), 4).tolist()
    assert found.lines.tolist() == [0, 1, 2, 3] * 4
    for k, (i, j) in enumerate(zip(found.seen, found.lines, strict=True)):
        assert found.scores[k] == pytest.approx(dense(P, j, z[i], R)[1], rel=1e-9)
        assert found.nearest[i] <= dense(P, j, z[i], R)[0] * (1 + 1e-9)


def test_what_does_not_fit_is_no_candidate_but_tells_how_near_it_is(P: Array) -> None:
    z = lines_in_frame(LINES[:1], POSE) + [[8.0, 0.5]]
    found = compare(P, z, two_sided=True)
    assert len(found.seen) == 0
    least = min(dense(P, j, z[0], R)[0] for j in range(4))
    assert 9.21 < found.nearest[0] == pytest.approx(least, rel=1e-9)


def test_what_is_written_the_other_way_about_is_turned_with_its_noise(P: Array) -> None:
    z = lines_in_frame(LINES[:1], POSE) + [0.05, 0.02]
    straight, turned = compare(P, z), compare(P, turned_over(z))
    k = int(np.nonzero(straight.lines == 0)[0][0])
    assert turned.turned[k] and not straight.turned[k]
    np.testing.assert_allclose(turned.residuals[k], straight.residuals[k], atol=1e-12)
    np.testing.assert_allclose(turned.noises[k], R * [[1, -1], [-1, 1]])
    assert not len(compare(P, turned_over(z), two_sided=True).seen)


def test_covariances_between_lines_are_those_of_the_dense_filter(P: Array) -> None:
    rows = at(LINES[:, 1], POSE)
    H = np.zeros((4, 2, 11))
    for line in range(4):
        H[line][:, [0, 1, 2, 3 + 2 * line, 4 + 2 * line]] = jacobian(rows[line])
    expected = np.einsum("aix,xy,bjy->abij", H, P, H)
    found = cross_covariances(np.triu(P), 3, rows, np.arange(4))
    np.testing.assert_allclose(found, expected, atol=1e-12)
