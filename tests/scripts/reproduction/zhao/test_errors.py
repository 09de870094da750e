"""Errors in the paper's terms, against trajectories whose errors are known."""

import numpy as np
import pytest

from grouser.scripts.reproduction.zhao.errors import (
    average_and_deviation,
    course_errors,
    distance,
    sizes,
    turned,
)

N = 101
HEADING = np.linspace(0, 3 * np.pi, N)
TRUTH = np.column_stack(
    [np.linspace(0, 2, N), np.zeros(N), (HEADING + np.pi) % (2 * np.pi) - np.pi]
)


def outcome(offset: np.ndarray) -> dict[str, np.ndarray]:
    return {"true_pose": TRUTH, "it.pose": TRUTH + offset}


def test_a_constant_error_is_the_average_and_has_no_deviation() -> None:
    errors = course_errors(outcome(np.array([0.01, -0.02, np.radians(359)])), "it")
    assert errors.shape == (N - 1, 3)
    values = average_and_deviation(errors)
    assert values["x_average_mm"] == pytest.approx(10)
    assert values["y_average_mm"] == pytest.approx(-20)
    assert values["heading_average_deg"] == pytest.approx(-1), "wrapped"
    for name in ("x_deviation_mm", "y_deviation_mm", "heading_deviation_deg"):
        assert values[name] == pytest.approx(0, abs=1e-9)


def test_sizes_do_not_cancel() -> None:
    ahead, behind = (course_errors(outcome(np.array([x, 0, x])), "it") for x in (0.03, -0.03))
    values = sizes([ahead, behind])
    assert values["position_mean_mm"] == pytest.approx(30)
    assert values["position_end_mm"] == pytest.approx(30)
    assert values["heading_mean_deg"] == pytest.approx(np.degrees(0.03))
    assert average_and_deviation(np.concatenate([ahead, behind]))["x_average_mm"] == pytest.approx(
        0, abs=1e-9
    )


def test_way_and_turn_are_true() -> None:
    assert distance(outcome(np.zeros(3))) == pytest.approx(2)
    assert turned(outcome(np.zeros(3)))[-1] == pytest.approx(3 * np.pi)
