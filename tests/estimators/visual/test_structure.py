"""An offset of all disparities shows in the points alone: exact without noise, honest under it."""

import numpy as np
import pytest

from grouser.estimators.visual.matching import Matches
from grouser.estimators.visual.motion import intrinsics
from grouser.estimators.visual.structure import OffsetEvidence, offset_of_structure
from grouser.geometry import Array
from grouser.rig import camera_mount
from tests.estimators.visual.clouds import matched, near_zero, six, stereo

CAMERA = stereo(camera_mount(0.15, 0.05, 0.4, pitch=0.17))
PRIOR = near_zero(0.01, 0.01, 0.005, 0.005)
NOISE = np.array([1e-3, 1e-3, 0.1, 0.08, 0.08, 0.1]) ** 2


def evidence(matches: Matches, offset: float, motion: Array) -> OffsetEvidence | None:
    """Of points whose disparities are all too large by the offset [px]."""
    return offset_of_structure(
        matches.reference + [0.0, 0.0, offset],
        matches.current + [0.0, 0.0, offset],
        motion=motion,
        inliers=np.ones(len(matches.reference), dtype=bool),
        prior=PRIOR,
        noise=np.tile(NOISE, (len(matches.reference), 1)),
        T_base_camera=CAMERA.T_base_camera,
        camera=intrinsics(CAMERA),
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
