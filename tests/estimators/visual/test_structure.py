"""Offset and bow of disparities show in the points alone: exact without noise, honest under it."""

import numpy as np
import pytest

from grouser.estimators.visual.bow import NO_BOW, Bow, Bowed
from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.motion import intrinsics
from grouser.estimators.visual.structure import OffsetEvidence, offset_of_structure
from grouser.geometry import Array
from grouser.rig import camera_mount
from tests.estimators.visual.clouds import matched, near_zero, six, stereo

CAMERA = stereo(camera_mount(0.15, 0.05, 0.4, pitch=0.17))
PRIOR = near_zero(0.01, 0.01, 0.005, 0.005)
NOISE = np.array([1e-3, 1e-3, 0.1, 0.08, 0.08, 0.1]) ** 2


def evidence(
    matches: Matches, offset: Array | float, motion: Array, bowed: Bowed | None = None
) -> OffsetEvidence | None:
    """Of points whose disparities are too large [px]: all alike, or (2, n) before and now."""
    too_large = np.zeros((2, len(matches.reference), 3))
    too_large[..., 2] = offset
    return offset_of_structure(
        matches.reference + too_large[0],
        matches.current + too_large[1],
        motion=motion,
        inliers=np.ones(len(matches.reference), dtype=bool),
        prior=PRIOR,
        noise=np.tile(NOISE, (len(matches.reference), 1)),
        T_base_camera=CAMERA.T_base_camera,
        camera=intrinsics(CAMERA),
        bowed=bowed,
    )


@pytest.mark.parametrize("offset", [-0.5, 0.0, 0.1, 1.5])
@pytest.mark.parametrize("motion", [(0.0, 0.25), (0.1, 0.2), (0.05, -0.25)])
def test_without_noise_the_offset_is_found(offset: float, motion: tuple[float, float]) -> None:
    truth = six(*motion)
    found = evidence(matched(np.random.default_rng(0), CAMERA, truth), offset, truth)
    assert found is not None
    assert found.offset == pytest.approx(offset, abs=0.002)


def test_it_is_as_uncertain_as_said() -> None:
    truth, errors, sigmas = six(0.05, 0.25), [], []
    for rng in np.random.default_rng(1).spawn(200):
        found = evidence(matched(rng, CAMERA, truth, noise=NOISE), 0.3, truth)
        assert found is not None
        errors.append(found.offset - 0.3)
        sigmas.append(found.sigma)
    assert abs(np.mean(errors)) < 0.02
    assert np.std(errors) == pytest.approx(np.mean(sigmas), rel=0.25)


@pytest.mark.parametrize("motion", [(0.0, 0.0), (0.0, 0.002)])
def test_at_rest_there_is_no_evidence(motion: tuple[float, float]) -> None:
    truth = six(*motion)
    matches = matched(np.random.default_rng(2), CAMERA, truth, noise=NOISE)
    assert evidence(matches, 0.5, truth) is None


def bowed_evidence(matches: Matches, bow: float, known: Bow, motion: Array) -> OffsetEvidence:
    """Of points whose disparities are too large by 0.3 px, and bowed, where so much is known."""
    middle = [CAMERA.cx, CAMERA.cy]
    by_bow = [
        -(((points[:, :2] - middle) / CAMERA.cx) ** 2).sum(axis=1)
        for points in (matches.reference, matches.current)
    ]
    too_large = 0.3 + (bow - known.px) * np.array(by_bow)
    found = evidence(matches, too_large, motion, Bowed(by_bow[0], by_bow[1], known))
    assert found is not None
    return found


@pytest.mark.parametrize("known", [Bow(0.0, 2.0), Bow(0.3, 1.0)])
def test_without_noise_the_bow_is_found_beside_the_offset(known: Bow) -> None:
    truth = six(0.05, 0.25)
    matches = matched(np.random.default_rng(0), CAMERA, truth)
    found = bowed_evidence(matches, 0.5, known, truth)
    assert found.bow is not None
    assert found.bow.px == pytest.approx(0.5, abs=0.03)
    assert found.offset == pytest.approx(0.3, abs=0.01)


def test_offset_and_bow_are_as_uncertain_as_said() -> None:
    truth, known = six(0.05, 0.25), Bow(0.2, 1.0)
    errors, sigmas = [], []
    for rng in np.random.default_rng(1).spawn(200):
        found = bowed_evidence(matched(rng, CAMERA, truth, noise=NOISE), 0.2, known, truth)
        assert found.bow is not None
        errors.append([found.offset - 0.3, found.bow.px - 0.2])
        sigmas.append([found.sigma, found.bow.sigma])
    assert np.abs(np.mean(errors, axis=0)).max() < 0.04
    np.testing.assert_allclose(np.std(errors, axis=0), np.mean(sigmas, axis=0), rtol=0.3)


def test_a_bow_that_is_known_is_not_sought() -> None:
    truth = six(0.05, 0.25)
    matches = matched(np.random.default_rng(3), CAMERA, truth, noise=NOISE)
    plain = evidence(matches, 0.3, truth)
    known = bowed_evidence(matches, 0.0, NO_BOW, truth)
    assert plain is not None and known.bow is None
    assert known.offset == pytest.approx(plain.offset, abs=1e-6)
