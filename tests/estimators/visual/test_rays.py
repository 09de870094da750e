"""Rays and inverse depths against points in metres."""

import numpy as np

from grouser.estimators.visual.rays import disparity_rays
from tests.estimators.visual.clouds import scattered, seen, stereo


def test_a_ray_over_its_inverse_depth_is_the_point() -> None:
    camera = stereo(fy=280.0)
    points = scattered(np.random.default_rng(0), 50, camera)
    rays, inverse = disparity_rays(seen(points, camera), camera)
    np.testing.assert_allclose(rays / inverse[:, None], points, rtol=1e-12)
