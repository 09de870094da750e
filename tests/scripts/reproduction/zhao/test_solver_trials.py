"""Trials of minimal solvers: what is counted is what happened."""

import numpy as np

from grouser.scripts.reproduction.zhao.solver_curves import solver_figures
from grouser.scripts.reproduction.zhao.solver_trials import (
    OUTLIER_RATIOS,
    OutlierTrials,
    SlipTrials,
    compared,
)
from grouser.scripts.reproduction.zhao.synthetic import moved, planar, scene, seen, spec_camera

TRIALS = {"solvers-outliers": OutlierTrials(12), "solvers-slip": SlipTrials(12)}
OUTCOMES = {name: trials.run(lambda: None) for name, trials in TRIALS.items()}
FIGURES = solver_figures(OUTCOMES)


def test_one_point_stands_four_fifths_of_outliers() -> None:
    for ratio in OUTLIER_RATIOS:
        prefix = f"solvers.outliers.{100 * ratio:.0f}.one-point"
        assert (FIGURES[f"{prefix}.success_percent"] or 0) >= 90
        assert (FIGURES[f"{prefix}.recall_percent"] or 0) > 95


def test_one_point_loses_inliers_with_side_slip_and_five_points_do_not() -> None:
    def recall(slip: int, solver: str) -> float:
        return FIGURES[f"solvers.slip.{slip}.{solver}.recall_percent"] or 0

    assert recall(0, "one-point") > 97 and recall(40, "one-point") < 85
    assert recall(40, "five-point") > 95
    behind = FIGURES["solvers.slip.recall_behind_percent"]
    assert behind is not None and 2 <= behind <= 30


def test_one_point_is_the_fastest() -> None:
    times = {name: FIGURES[f"solvers.outliers.30.{name}.ms"] or 0 for name in compared()}
    assert min(times, key=lambda name: times[name]) == "one-point"


def test_trials_repeat_but_for_their_times() -> None:
    again = OutlierTrials(12).run(lambda: None)
    for key in again:
        if not key.endswith(".ms"):
            np.testing.assert_array_equal(again[key], OUTCOMES["solvers-outliers"][key])


def test_a_scene_holds_as_many_outliers_as_asked() -> None:
    camera, motion = spec_camera(0.2), planar(0.05, 0.1)
    drawn = scene(np.random.default_rng(0), camera, motion, outlier_ratio=0.25)
    assert (~drawn.right).sum() == 16
    w, w_ = drawn.matches.reference, drawn.matches.current
    z = camera.fx * camera.baseline / w[:, 2]
    rays = np.column_stack([(w[:, :2] - [camera.cx, camera.cy]) / camera.fx, np.ones(64)])
    expected = seen(moved(rays * z[:, None], motion, camera), camera)
    assert np.abs(expected - w_)[drawn.right][:, :2].max() < 6 * 0.3 * 2
