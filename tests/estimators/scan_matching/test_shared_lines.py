"""Many scans of a surface hold another scan at their mean, and walls that differ stay apart."""

import numpy as np
import pytest

from grouser.estimators.scan_matching.alignment import AlignmentOptions, align
from grouser.estimators.scan_matching.reference import Reference, make_reference
from grouser.estimators.scan_matching.shared_lines import line_at
from tests.estimators.scan_matching.test_matcher import EXACT, HOUSE, surface

SPREAD = 0.03 * np.array([-1.0, -0.6, -0.2, 0.2, 0.6, 1.0])


def shifted_scans() -> Reference:
    """One place seen six times, with errors of a few centimetres in the poses."""
    seen_alike = [surface(HOUSE, EXACT, np.zeros(3), None) for _ in SPREAD]
    return make_reference(seen_alike, np.column_stack([SPREAD, -SPREAD, 0 * SPREAD]))


@pytest.mark.parametrize("start", [[0.03, -0.03, 0.0], [-0.03, 0.03, 0.0], [0.02, 0.02, 0.01]])
def test_a_scan_comes_to_rest_at_the_mean_wherever_it_begins(start: list[float]) -> None:
    scan = surface(HOUSE, EXACT, np.zeros(3), None)
    begin, unsure = np.array(start), 1e-3 * np.eye(3)
    aligned = align(scan, shifted_scans(), begin, begin, unsure, AlignmentOptions())
    assert np.abs(aligned.pose).max() < 2e-3


def test_lines_are_the_mean_of_all_scans_and_of_one_scan_its_own() -> None:
    alone = surface(HOUSE, EXACT, np.zeros(3), None)
    single = make_reference([alone], np.zeros(3))
    several = shifted_scans()
    n, off = len(alone.points), []
    for p in np.flatnonzero(np.isfinite(alone.normal_sigmas)):
        own = line_at(single.surface, single.shared, p)
        np.testing.assert_allclose(own, [*alone.feet[p], *alone.normals[p]], atol=1e-12)
        for scan in range(len(SPREAD)):
            line = line_at(several.surface, several.shared, scan * n + p)
            off.append((line[:2] - alone.feet[p]) @ alone.normals[p])
    assert np.median(np.abs(off)) < 1e-6  # corners aside


def test_the_two_sides_of_a_thin_wall_are_not_averaged() -> None:
    inside = surface(HOUSE, EXACT, np.zeros(3), None)
    other_side = inside._replace(normals=-inside.normals)
    reference = make_reference([inside, other_side], np.array([[0, 0, 0], [0.05, 0.05, 0]]))
    for p in np.flatnonzero(np.isfinite(inside.normal_sigmas)):
        line = line_at(reference.surface, reference.shared, p)
        np.testing.assert_allclose(line, [*inside.feet[p], *inside.normals[p]], atol=1e-12)
