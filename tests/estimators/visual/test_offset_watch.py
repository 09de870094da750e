"""Keyframes together: surer than each, unmoved by a few, and seldom wrong when all is well."""

import numpy as np
import pytest

from grouser.estimators.visual.offset_watch import SYSTEMATIC, OffsetEstimate, OffsetWatch
from grouser.estimators.visual.structure import OffsetEvidence


def watched(offsets: list[float], sigma: float = 0.03) -> OffsetEstimate | None:
    watch = OffsetWatch()
    for offset in offsets:
        watch.add(OffsetEvidence(offset, sigma))
    return watch.estimate


def test_three_keyframes_are_too_few() -> None:
    assert watched([0.5, 0.5, 0.5]) is None


def test_offsets_are_suspected_and_their_absence_is_not() -> None:
    """Keyframes that scatter as the simulated robot's do: from a tenth of a pixel on."""
    suspected = {0.0: 0, 0.1: 0, 1.5: 0}
    for rng in np.random.default_rng(0).spawn(300):
        for offset in suspected:
            estimate = watched(list(offset + 0.05 * rng.normal(size=25)))
            assert estimate is not None
            suspected[offset] += estimate.suspect
    assert suspected[0.0] == 0
    assert suspected[0.1] > 280 and suspected[1.5] == 300


def test_the_sigma_follows_the_scatter_down_to_what_all_have_in_common() -> None:
    rng = np.random.default_rng(1)
    few, many = (watched(list(0.2 * rng.normal(size=n))) for n in (10, 100))
    assert few is not None and many is not None
    assert few.sigma == pytest.approx(0.2 / np.sqrt(10), rel=0.5)
    assert SYSTEMATIC < many.sigma < few.sigma


def test_wrong_keyframes_do_not_carry_the_mean_away() -> None:
    rng = np.random.default_rng(2)
    estimate = watched([*(0.3 + 0.05 * rng.normal(size=20)), 4.0, -3.0, 5.0])
    assert estimate is not None
    assert estimate.offset == pytest.approx(0.3, abs=0.1)


def test_what_was_long_ago_is_forgotten() -> None:
    estimate = watched([0.5] * 300 + [0.1] * 100)
    assert estimate is not None and estimate.offset == pytest.approx(0.1)
