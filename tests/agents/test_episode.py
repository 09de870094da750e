"""An episode is kept as it went, and is the same whoever drives it again."""

import math
from typing import Any

import pytest

from grouser.agents import open_loop
from grouser.agents.episode import Episode, Trial, run_trial
from grouser.agents.open_loop import replayed_ate

TASK: dict[str, Any] = {"robot": {"dynamics": "fast"}}


def test_success_is_weighed_by_how_direct_the_way_was() -> None:
    kept = run_trial(Trial("pursuit", "ground-truth", 0, TASK))
    assert kept.success and kept.outcome == "success" and not kept.collision
    directness = kept.shortest_path_m / max(kept.shortest_path_m, kept.path_length_m)
    assert kept.spl == directness and 0.85 < directness <= 1
    assert 0.9 * directness < kept.soft_spl <= directness
    assert kept.position_error_m < 1e-9 and kept.lost == 0
    assert kept.distance_to_goal_m <= 0.15
    assert kept.believed_distance_to_goal_m == pytest.approx(kept.distance_to_goal_m)
    assert 0.2 < kept.path_length_m / kept.time_s < 0.5  # m/s


def test_a_failure_scores_the_way_that_it_gained() -> None:
    kept = run_trial(Trial("pursuit", "ground-truth", 0, {**TASK, "time_limit": 5.0}))
    assert kept.outcome == "timeout" and not kept.success and kept.spl == 0
    assert 0 < kept.soft_spl < 0.5 and kept.time_s == pytest.approx(5.0)
    assert kept.distance_to_goal_m > 1


def test_by_a_drifting_pose_the_robot_believes_otherwise() -> None:
    kept = run_trial(Trial("pursuit", "dead-reckoning", 0, {**TASK, "goals": 3}))
    assert kept.position_error_m > 0.01
    assert kept.distance_to_goal_m != kept.believed_distance_to_goal_m


def test_the_same_trial_gives_the_same_episode() -> None:
    def once() -> Episode:
        return run_trial(Trial("pursuit", "ekf-line-slam", 3, TASK))

    assert once() == once()


def test_an_estimator_without_error_has_none_on_a_replayed_drive() -> None:
    assert replayed_ate(Trial("pursuit", "ground-truth", 1, TASK)) < 1e-9


def test_a_replayed_drive_is_as_long_as_the_one_under_the_true_pose(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen: list[Any] = []

    def counted(truth: Any, believed: Any) -> float:
        seen.append((truth, believed))
        return 0.0

    monkeypatch.setattr(open_loop, "ate_se2", counted)
    replayed_ate(Trial("pursuit", "dead-reckoning", 1, TASK))
    replayed_ate(Trial("pursuit", "ground-truth", 1, TASK))
    (truth, drifted), (again, exact) = seen
    # The robot drives the same, bit for bit, whoever watches.
    assert truth.tobytes() == again.tobytes()
    assert abs(exact - again).max() < 1e-9
    driven = run_trial(Trial("pursuit", "ground-truth", 1, TASK))
    assert len(truth) == round(driven.time_s / 0.1)
    assert math.dist(truth[-1, :2], drifted[-1, :2]) > 0
