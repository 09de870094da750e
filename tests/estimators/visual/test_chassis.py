"""The chassis' motion from the camera's, against plain SE(3)."""

import numpy as np
import pytest

from grouser.estimators.visual.chassis import chassis_motions
from grouser.geometry import Array, inverse_transform
from tests.estimators.visual.clouds import MOUNTS, chassis


@pytest.mark.parametrize("mount", MOUNTS.values(), ids=MOUNTS.keys())
def test_it_is_the_motion_that_moved_the_camera(mount: Array) -> None:
    motions = np.random.default_rng(0).uniform(-0.5, 0.5, (20, 6))
    T = [
        inverse_transform(mount) @ inverse_transform(chassis(motion)) @ mount for motion in motions
    ]
    R, t = np.array(T)[:, :3, :3], np.array(T)[:, :3, 3]
    np.testing.assert_allclose(chassis_motions(R, t, mount), motions, atol=1e-12)
    np.testing.assert_allclose(chassis_motions(R[0], t[0], mount), motions[0], atol=1e-12)
