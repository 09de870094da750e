"""One scan laid over another: exact without noise, honest with it, and nothing along a corridor."""

import subprocess
import sys

import numpy as np
import pytest

from grouser.estimators.line_slam.scan import ScanReader
from grouser.estimators.scan_matching.alignment import AlignmentOptions, align, believed
from grouser.estimators.scan_matching.matcher import (
    MatchOptions,
    ScanMatch,
    ScanMatcher,
    between_steps,
)
from grouser.estimators.scan_matching.reference import make_reference
from grouser.estimators.scan_matching.search import SearchOptions, search, value
from grouser.estimators.scan_matching.surface import Surface, surface_of
from grouser.geometry import Array, compose, wrap
from grouser.rig import Lidar
from tests.estimators.line_slam.walls import lidar, mounted, polygon, seen

HOUSE = polygon([[-4, -3], [5, -4], [6, 2], [1, 5], [-5, 3]])
CORRIDOR = np.array([[[-100.0, -1.0], [100.0, -1.0]], [[-100.0, 1.2], [100.0, 1.2]]])
EXACT = lidar(sigma_range=0.0, sigma_bearing=0.0, mount=mounted(0.2, 0.1, 0.4))


def surface(walls: Array, sensor: Lidar, pose: Array, rng: np.random.Generator | None) -> Surface:
    return surface_of(ScanReader(sensor).read(seen(walls, sensor, pose, rng)))


def matched(
    walls: Array,
    sensor: Lidar,
    start: Array,
    motion: Array,
    guess: Array,
    guess_covariance: Array | None = None,
    rng: np.random.Generator | None = None,
) -> ScanMatch:
    """A scan after a motion over one before it."""
    reference = make_reference([surface(walls, sensor, start, rng)], np.zeros(3))
    after = surface(walls, sensor, compose(start, motion), rng)
    return ScanMatcher().match(after, reference, guess, guess_covariance)


def error(match: ScanMatch, motion: Array) -> Array:
    off = match.pose - motion
    off[2] = wrap(off[2])
    return off


@pytest.mark.parametrize("motion", [[0.3, 0.1, 0.1], [0.5, -0.2, -0.2], [0.0, 0.0, 0.0]])
def test_a_motion_is_recovered_from_scans_without_noise(motion: list[float]) -> None:
    guess = np.array(motion) + [0.25, -0.2, 0.15]
    match = matched(HOUSE, EXACT, np.array([0.3, 0.2, 0.5]), np.array(motion), guess)
    assert np.abs(error(match, np.array(motion))).max() < 1e-4
    assert match.score > 0.9 and match.inlier_ratio > 0.95
    assert 0.3 < match.eigenvalue_ratio <= 1.0


def test_the_covariance_is_as_large_as_the_errors() -> None:
    rng, sensor = np.random.default_rng(1), lidar(mount=mounted(0.2, 0.0))
    nees = []
    for _ in range(150):
        start = np.append(rng.uniform([-1.5, -1.0], [2.0, 1.5]), rng.uniform(-3, 3))
        motion = rng.normal(size=3) * [0.3, 0.2, 0.15]
        match = matched(HOUSE, sensor, start, motion, motion + rng.normal(size=3) * 0.05, rng=rng)
        off = error(match, motion)
        nees.append(off @ np.linalg.solve(match.covariance, off))
    assert 1.5 < np.mean(nees) < 4.0


def test_along_a_corridor_the_pose_and_its_covariance_are_those_of_the_guess() -> None:
    rng = np.random.default_rng(2)
    sensor = lidar(range_max=12.0)
    prior = np.diag([0.1, 0.1, 0.05]) ** 2
    motion, nees = np.array([0.4, 0.0, 0.02]), []
    for _ in range(60):
        guess = motion + rng.normal(size=3) * [0.1, 0.1, 0.05]
        match = matched(CORRIDOR, sensor, np.zeros(3), motion, guess, prior, rng)
        assert abs(match.pose[0] - guess[0]) < 0.01
        assert np.sqrt(match.covariance[0, 0]) == pytest.approx(0.1, rel=0.05)
        assert np.sqrt(match.covariance[1, 1]) < 0.01
        assert np.linalg.matrix_rank(match.information, tol=1e-3) == 2
        assert match.eigenvalue_ratio < 0.01
        off = error(match, motion)
        nees.append(off @ np.linalg.solve(match.covariance, off))
    assert 1.5 < np.mean(nees) < 4.0


def test_one_door_post_holds_a_scan_along_a_corridor() -> None:
    post = np.array([[[3.0, 0.9], [3.0, 1.2]], [[3.0, 0.9], [3.2, 0.9]], [[3.2, 0.9], [3.2, 1.2]]])
    rng, sensor = np.random.default_rng(3), lidar(720, range_max=12.0)
    walls, motion = np.concatenate([CORRIDOR, post]), np.array([0.3, 0.0, 0.0])
    prior = np.diag([0.1, 0.1, 0.05]) ** 2
    match = matched(walls, sensor, np.zeros(3), motion, motion + [0.1, 0, 0], prior, rng)
    assert np.sqrt(match.covariance[0, 0]) < 0.02
    assert abs(match.pose[0] - motion[0]) < 3 * np.sqrt(match.covariance[0, 0])


def test_what_each_scan_of_the_reference_tells_adds_up() -> None:
    rng, sensor = np.random.default_rng(4), lidar()
    poses = np.array([[0.0, 0.0, 0.0], [0.4, 0.1, 0.3], [0.8, 0.1, 0.5]])
    scans = [surface(HOUSE, sensor, pose, rng) for pose in poses]
    match = ScanMatcher().match(scans[2], make_reference(scans[:2], poses[:2]), poses[2])
    assert match.by_scan.shape == (2, 3, 3)
    np.testing.assert_allclose(match.by_scan.sum(axis=0), match.information, rtol=1e-9, atol=1e-6)


def test_nothing_seen_or_nothing_known_leaves_the_guess() -> None:
    empty = np.zeros((0, 2))
    some, none = (
        surface(HOUSE, EXACT, np.zeros(3), None),
        Surface(empty, empty, empty, np.zeros(0), 0.01),
    )
    guess, prior = np.array([0.1, 0.2, 0.3]), np.diag([0.1, 0.2, 0.3]) ** 2
    for scan, known in ((none, some), (some, none), (none, none)):
        match = ScanMatcher().match(scan, make_reference([known], np.zeros(3)), guess, prior)
        np.testing.assert_allclose(match.pose, guess, atol=1e-12)
        np.testing.assert_allclose(match.covariance, prior, rtol=1e-9)
        assert match.score == match.inlier_ratio == match.eigenvalue_ratio == 0.0


def test_noise_in_normals_makes_no_information() -> None:
    A, S = np.diag([900.0, 10.0, 5.0]), np.diag([1.0, 8.0, 1.0])
    np.testing.assert_allclose(believed(A, S) @ A, np.diag([899.0, 0.0, 4.0]), atol=1e-5)
    T = np.array([[1.0, 0.2, 0.3], [0.1, 1.0, -0.4], [0.0, 0.3, 1.0]])  # the same, seen elsewhere
    kept = believed(T @ A @ T.T, T @ S @ T.T) @ (T @ A @ T.T)
    np.testing.assert_allclose(kept, T @ np.diag([899.0, 0.0, 4.0]) @ T.T, atol=1e-4)


_ONE_MATCH = """
import numpy as np
from tests.estimators.scan_matching.test_matcher import HOUSE, matched, lidar
match = matched(HOUSE, lidar(), np.zeros(3), np.array([.3, .1, .1]), np.array([.2, .2, .0]),
                rng=np.random.default_rng(5))
print(match.pose.tobytes().hex(), match.covariance.tobytes().hex(), match.score)
"""


def test_two_processes_find_the_same_bits() -> None:
    told = {
        subprocess.run(
            [sys.executable, "-c", _ONE_MATCH], capture_output=True, text=True, check=True
        ).stdout
        for _ in range(2)
    }
    assert len(told) == 1


def test_wrong_options_and_references_are_refused() -> None:
    with pytest.raises(ValueError, match="first_radius must be at most 0.3 m, got 0.5"):
        AlignmentOptions(first_radius=0.5)
    with pytest.raises(ValueError, match="coarse_position must be positive, got 0"):
        MatchOptions(search=SearchOptions(coarse_position=0))
    with pytest.raises(ValueError, match="needs scans, each with a pose, got 0 scans and 1 poses"):
        make_reference([], np.zeros(3))


def test_no_pairs_lure_a_scan_from_where_more_of_it_fits() -> None:
    """Boxes that stand 15 to 30 cm off now pull at many points, all to the same side."""
    rng, sensor = np.random.default_rng(5), lidar(mount=mounted(0.2, 0.0))
    lured = 0
    for _ in range(60):
        boxes = np.concatenate(
            [
                polygon(rng.uniform(-3, 3, 2) + np.array([[0, 0], [0.9, 0], [0.9, 0.9], [0, 0.9]]))
                for _ in range(7)
            ]
        )
        shifted = boxes + rng.uniform(0.15, 0.3, 2) * rng.choice([-1, 1], 2)
        before = surface(np.concatenate([HOUSE, boxes]), sensor, np.zeros(3), rng)
        scan = surface(np.concatenate([HOUSE, shifted]), sensor, np.zeros(3), rng)
        reference = make_reference([before], np.zeros(3))
        guess, width = rng.normal(size=3) * [0.05, 0.05, 0.1], SearchOptions()
        prior = np.linalg.inv(np.diag([0.1, 0.1, 0.2]) ** 2)
        start = search(scan.points, reference.field, guess, prior, width)
        least = value(scan.points, reference.field, start, guess, prior, width) - 1
        plain = align(scan, reference, start, guess, prior, AlignmentOptions())
        if between_steps(start, plain.pose, width):
            continue
        draws = value(scan.points, reference.field, plain.pose, guess, prior, width) < least
        lured += draws
        match = ScanMatcher().match(scan, reference, guess, np.linalg.inv(prior))
        assert match.doubt.any() == draws
        if draws:
            assert match.pose + match.doubt == pytest.approx(plain.pose)
        assert value(scan.points, reference.field, match.pose, guess, prior, width) >= least - 1e-9
    assert lured >= 3, "the case does not occur"
