"""The camera's offset and slip, told apart."""

import numpy as np
import pytest

from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.scripts.reproduction.zhao import offset_study
from grouser.scripts.reproduction.zhao.offset_study import (
    OffsetExperiment,
    offset_figures,
)


def test_what_is_expected_of_points_at_one_depth_is_a_over_z() -> None:
    camera = TrackedRobotEnv(sensors=()).rig.stereo
    assert camera is not None
    rng, z = np.random.default_rng(0), 2.5
    d = camera.fx * camera.baseline / z
    points = np.column_stack([rng.uniform(0, 320, 50), rng.uniform(0, 240, 50), np.full(50, d)])
    assert offset_study._excess_of(points, camera) == pytest.approx(0.2 / z)


def test_the_offset_not_the_ground_makes_the_error_of_motion_on_arcs() -> None:
    """A twelfth of a turn on asphalt: known, the offset costs nothing; ignored, many degrees."""
    outcomes = {}
    for ground in ("asphalt", "ice", "unequal"):
        experiment = OffsetExperiment(ground, ("one-point-ransac",), frames=40)
        outcomes[experiment.name] = experiment.run(lambda: None)
    figures = offset_figures(outcomes, ("one-point-ransac",))
    arc = "offset.asphalt.one-point-vision-alone-on-arcs"
    knows, ignores = (figures[f"{arc}.{key}"] or 0 for key in ("knows_deg", "ignores_deg"))
    assert abs(knows) < 2 and ignores > 20
    assert (figures[f"{arc}.offset_part_percent"] or 0) > 90
    # Unequal contact moves the centre of the turn; with good contact it stays where it is.
    assert (figures["offset.unequal.centre_mm"] or 0) > 100
    assert (figures["offset.asphalt.centre_mm"] or 0) < 20
