"""Constant errors keep their order and their numbers when models are joined."""

import numpy as np

from grouser.estimators.visual.constant_errors import NO_ERRORS, disparity_offset
from grouser.estimators.visual.prediction import ScaleOptions


def test_errors_of_two_models_follow_each_other() -> None:
    scales, offset = (
        ScaleOptions(track_sigma=0.04, turn_sigma=0.2, side_sigma=0.03, walk=2e-3).errors(),
        disparity_offset(0.1),
    )
    both = scales + offset
    assert both.names == (*scales.names, "disparity offset [px]") and len(both) == 5
    np.testing.assert_array_equal(both.sigmas, [0.04, 0.04, 0.2, 0.03, 0.1])
    np.testing.assert_array_equal(both.walks, [2e-3, 2e-3, 2e-3, 2e-3, 1e-3])


def test_no_errors_add_nothing() -> None:
    offset = disparity_offset(0.1)
    assert len(NO_ERRORS) == 0
    assert (NO_ERRORS + offset).names == offset.names == (offset + NO_ERRORS).names
