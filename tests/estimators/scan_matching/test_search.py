"""The search finds the best of its poses, though it looks at most of them but briefly."""

from itertools import product

import numpy as np

from grouser.estimators.line_slam.scan import ScanReader
from grouser.estimators.scan_matching.reference import Reference, make_reference
from grouser.estimators.scan_matching.search import SearchOptions, search, value
from grouser.estimators.scan_matching.surface import surface_of
from grouser.geometry import Array, wrap
from tests.estimators.line_slam.walls import lidar, polygon, seen

HOUSE = polygon([[-4, -3], [5, -4], [6, 2], [1, 5], [-5, 3]])
SMALL = SearchOptions(position=0.2, heading=0.1, coarse_heading=0.05, fine_heading=0.025)


def best_of_all(points: Array, reference: Reference, guess: Array, prior: Array) -> Array:
    """By `value` of each of them, from coarse to fine."""
    best = guess
    for reach, step, turn, heading in ((2, 0.1, 2, 0.05), (2, 0.05, 2, 0.025)):
        around = product(range(-turn, turn + 1), *[range(-reach, reach + 1)] * 2)
        poses = [best + [i * step, j * step, k * heading] for k, i, j in around]
        told = [value(points, reference.field, pose, guess, prior, SMALL) for pose in poses]
        best = poses[int(np.argmax(told))]
    best[2] = wrap(best[2])
    return np.asarray(best)


def test_no_pose_of_the_search_is_better_than_the_one_that_it_finds() -> None:
    rng, sensor = np.random.default_rng(3), lidar(120)
    reader = ScanReader(sensor)
    reference = make_reference(
        [surface_of(reader.read(seen(HOUSE, sensor, np.zeros(3), rng)))], np.zeros(3)
    )
    for sigmas in ([0.1, 0.1, 0.05], [1.0, 1.0, 0.5]):
        prior = np.diag(np.array(sigmas) ** -2)
        for _ in range(10):
            pose = rng.normal(size=3) * [0.3, 0.3, 0.2]
            points = surface_of(reader.read(seen(HOUSE, sensor, pose, rng))).points
            guess = pose + rng.normal(size=3) * [0.1, 0.1, 0.05]
            found = search(points, reference.field, guess, prior, SMALL)
            expected = best_of_all(points, reference, guess, prior)
            np.testing.assert_allclose(found, expected, atol=1e-9)


def test_where_nothing_fits_it_stays_at_the_guess() -> None:
    sensor = lidar(120)
    scan = surface_of(ScanReader(sensor).read(seen(HOUSE, sensor, np.zeros(3), None)))
    reference, far = make_reference([scan], np.zeros(3)), np.array([500.0, 0.0, 0.3])
    prior = np.eye(3)
    np.testing.assert_array_equal(
        search(scan.points, reference.field, far, prior, SearchOptions()), far
    )
    np.testing.assert_array_equal(
        search(np.zeros((0, 2)), reference.field, far, prior, SearchOptions()), far
    )
