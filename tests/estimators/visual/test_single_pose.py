"""One pose at a time is what `grouser.geometry` makes of arrays of them."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from grouser import geometry
from grouser.estimators.visual import single_pose

angles = st.floats(-7.0, 7.0) | st.sampled_from([np.pi, -np.pi, 3 * np.pi, -np.pi - 1e-16])
lengths = st.floats(-100.0, 100.0)
poses = st.tuples(lengths, lengths, angles).map(np.array)


@settings(deadline=None)  # the first call compiles
@given(angles)
def test_angles_are_wrapped_alike(angle: float) -> None:
    assert single_pose.wrapped(angle) == geometry.wrap(angle)


@settings(deadline=None)  # the first call compiles
@given(poses, poses)
def test_poses_are_composed_alike(a: geometry.Array, b: geometry.Array) -> None:
    np.testing.assert_allclose(single_pose.compose(a, b), geometry.compose(a, b), atol=1e-12)
    np.testing.assert_allclose(single_pose.between(a, b), geometry.between(a, b), atol=1e-12)
    ours, theirs = single_pose.compose_jacobians(a, b), geometry.compose_jacobians(a, b)
    for mine, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-12)


def test_a_covariance_is_carried_through_a_step() -> None:
    rng = np.random.default_rng(0)
    F, P, V, Q = rng.normal(size=(4, 3, 3))
    np.testing.assert_allclose(single_pose.carried(F, P, V, Q), F @ P @ F.T + V @ Q @ V.T)
