"""The paper's filter settles on a fixed blend, and its covariance knows nothing of the way."""

import numpy as np

from grouser.estimators.visual.constant_errors import NO_ERRORS
from grouser.estimators.visual.fusion import Accumulated, RelativePose
from grouser.estimators.visual.printed_filter import _Q, _R, PrintedFilter
from grouser.geometry import Array, between, compose

SAID = np.array([0.10, 0.0, 0.01])  # by the tracks
SEEN = np.array([0.12, 0.0, 0.03])


def predicted(pose: Array) -> Accumulated:
    return Accumulated(pose, 1e-6 * np.eye(3), np.zeros((3, 0)), 1)


def measured(pose: Array) -> RelativePose:
    return RelativePose(pose, 1e-6 * np.eye(3), np.zeros(3))


def test_it_settles_on_the_blend_of_constant_q_and_r() -> None:
    """SPEC 1.5: P- = (Q + sqrt(Q^2 + 4 Q R)) / 2, and the gain is P- / (P- + R)."""
    kalman = PrintedFilter(NO_ERRORS)
    for _ in range(60):
        fused = kalman.fuse(predicted(SAID), measured(SEEN))
        step = kalman.relative(fused)
        kalman.commit(fused)
    Q, R = np.diag(_Q), np.diag(_R)
    P = (Q + np.sqrt(Q**2 + 4 * Q * R)) / 2
    gain = P / (P + R)
    np.testing.assert_allclose(np.diag(fused.state.covariance), (1 - gain) * P, rtol=1e-6)
    expected = between(np.zeros(3), SAID + gain * (SEEN - SAID))
    np.testing.assert_allclose(step[[0, 2]], expected[[0, 2]], atol=1e-6)


def test_with_agreement_it_composes_and_with_nothing_seen_it_is_less_sure_each_frame() -> None:
    kalman = PrintedFilter(NO_ERRORS)
    kalman.commit(kalman.fuse(predicted(SAID), measured(SAID)))
    fused = kalman.coast(predicted(SEEN))
    np.testing.assert_allclose(fused.state.pose, compose(SAID, SEEN), atol=1e-12)
    before = kalman.fuse(predicted(np.zeros(3)), measured(np.zeros(3))).state.covariance
    kalman.commit(fused)
    after = kalman.coast(predicted(SEEN)).state.covariance
    assert (np.diag(after) > np.diag(before)).all()
