"""A run's figures are those of its definition; what does not exist is null, not a number."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from grouser.estimators.base import PoseEstimate, Status
from grouser.estimators.evaluation.comparison import (
    Run,
    compare_closed_loop,
    compare_open_loop,
)
from grouser.estimators.evaluation.summary import WARM_UP_UPDATES, summarise
from grouser.estimators.ground_truth import GroundTruth
from grouser.geometry import Array, lift

Make = Callable[..., Any]

KEYS = [
    "estimator",
    "source",
    "seed",
    "steps",
    "distance_m",
    "ate_m",
    "smoothed_ate_m",
    "ate_alignment",
    "final_error_m",
    "final_sigma_m",
    "final_heading_error_deg",
    "drift_percent",
    "drift_deg_per_m",
    "drift_percent_3d",
    "drift_deg_per_m_3d",
    "rpe_m",
    "rpe_deg",
    "nees_mean",
    "tracking_fraction",
    "lost_fraction",
    "ms_per_frame_median",
    "ms_per_frame_p95",
]


def straight(n: int = 81, scale: float = 1.0, height: bool = False) -> Run:
    """Eight metres ahead, estimated with an error of scale."""
    along = np.linspace(0, 8, n)
    truth = np.stack([along, 0 * along, 0 * along], axis=1)

    def estimate(pose: Array, index: int) -> PoseEstimate:
        return PoseEstimate(
            pose=pose * scale,
            covariance=np.diag([0.01, 0.01, 0.01]) * index,
            status=Status.TRACKING,
            stamp=0.1 * index,
            pose_3d=lift(pose) if height else None,
        )

    return Run(
        estimator="ruler",
        seed=4,
        stamps=np.linspace(0, 0.1 * (n - 1), n),
        estimates=tuple(estimate(pose, index) for index, pose in enumerate(truth)),
        update_ms=np.full(n - 1, 2.0),
        true_poses=truth,
        true_poses_3d=lift(truth),
    )


def test_the_keys_are_the_published_ones() -> None:
    assert list(summarise(straight(), "world:yard")) == KEYS


def test_a_straight_run_with_two_percent_of_scale() -> None:
    figures = summarise(straight(scale=1.02), "world:yard")
    assert (figures["estimator"], figures["source"]) == ("ruler", "world:yard")
    assert (figures["seed"], figures["steps"]) == (4, 80)
    assert figures["distance_m"] == pytest.approx(8)
    assert figures["final_error_m"] == pytest.approx(0.16)
    assert figures["final_heading_error_deg"] == pytest.approx(0)
    assert figures["rpe_m"] == pytest.approx(0.002)
    assert figures["drift_percent"] == pytest.approx(2, rel=0.03)
    assert figures["drift_deg_per_m"] == pytest.approx(0)
    assert figures["ate_m"] == pytest.approx(0.02 * np.std(np.linspace(0, 8, 81)))
    assert figures["smoothed_ate_m"] is None
    assert figures["ate_alignment"] == "SE(2)"
    # e = 0.002 k m, P = 0.01 k m^2: e^2 / P = 0.0004 k, over k = 1 to 80.
    assert figures["nees_mean"] == pytest.approx(0.0004 * 40.5)


def test_what_does_not_exist_is_null(robot: Make) -> None:
    env = robot()
    estimators = {"ground-truth": GroundTruth(env.rig)}
    (run,) = compare_open_loop(env, estimators, lambda step: np.array([0.5, 0.5]), seed=0, steps=20)
    figures = summarise(run, "world:yard")
    assert figures["nees_mean"] is None, "its covariance is zero"
    assert figures["drift_percent"] is None, "half a metre holds no segment of five"
    assert figures["drift_percent_3d"] is None
    assert figures["ate_m"] == pytest.approx(0, abs=1e-9)


def test_a_run_that_ends_where_it_begins_has_no_motion_to_judge(robot: Make, witness: Make) -> None:
    """A driver whose only waypoint is the start is there before the first step."""
    run = compare_closed_loop(robot(), "w", witness(), lambda _: None, seed=0)
    figures = summarise(run, "world:yard")
    assert list(figures) == KEYS
    assert (figures["steps"], figures["distance_m"], figures["final_error_m"]) == (0, 0, 0)
    nothing = {"rpe_m", "rpe_deg", "tracking_fraction", "lost_fraction", "ms_per_frame_median"}
    assert all(figures[key] is None for key in nothing)


def test_3d_drift_is_for_estimators_with_3d_poses_throughout() -> None:
    assert summarise(straight(scale=1.02), "")["drift_percent_3d"] is None
    run = straight(scale=1.02, height=True)
    assert summarise(run, "")["drift_percent_3d"] == pytest.approx(0, abs=1e-9)
    partly = (*run.estimates[:-1], replace(run.estimates[-1], pose_3d=None))
    assert summarise(replace(run, estimates=partly), "")["drift_percent_3d"] is None


def test_without_truth_there_is_no_accuracy() -> None:
    figures = summarise(replace(straight(), true_poses=None, true_poses_3d=None), "log:x")
    assert list(figures) == KEYS
    missing = {key for key, value in figures.items() if value is None}
    assert missing == set(KEYS[KEYS.index("distance_m") : KEYS.index("nees_mean") + 1])


def test_fractions_are_of_the_updates() -> None:
    run = straight(n=11)
    changed = [replace(e, status=Status.LOST) for e in run.estimates[1:4]]
    coasting = [replace(run.estimates[4], status=Status.COASTING)]
    estimates = (run.estimates[0], *changed, *coasting, *run.estimates[5:])
    figures = summarise(replace(run, estimates=estimates), "")
    assert figures["lost_fraction"] == pytest.approx(0.3)
    assert figures["tracking_fraction"] == pytest.approx(0.6)


def test_times_leave_the_warm_up_out() -> None:
    run = straight()
    times = np.linspace(1, 3, len(run.update_ms))
    times[:WARM_UP_UPDATES] = 1e4
    figures = summarise(replace(run, update_ms=times), "")
    assert figures["ms_per_frame_median"] == pytest.approx(np.median(times[WARM_UP_UPDATES:]))
    assert 2.8 < figures["ms_per_frame_p95"] < 3
    short = straight(n=WARM_UP_UPDATES + 1)
    assert summarise(short, "")["ms_per_frame_median"] is None


def test_the_way_as_it_is_known_in_the_end_is_scored_beside() -> None:
    run = straight(scale=1.02)
    assert run.true_poses is not None
    figures = summarise(replace(run, smoothed=1.01 * run.true_poses), "world:yard")
    assert figures["smoothed_ate_m"] == pytest.approx(figures["ate_m"] / 2)
