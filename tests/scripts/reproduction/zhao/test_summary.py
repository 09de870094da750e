"""Verdicts say what the numbers say."""

import pytest

from grouser.scripts.reproduction.figures import Figures
from grouser.scripts.reproduction.zhao.errors import AXES
from grouser.scripts.reproduction.zhao.paper import paper_figures
from grouser.scripts.reproduction.zhao.summary import summary_figures

KINDS = (
    *("linear_indoors", "linear_outdoors", "spot_turn_asphalt", "spot_turn_cement"),
    *("free_indoors", "free_outdoors_1", "free_outdoors_2", "free_outdoors_3"),
)


def figures(size: float) -> Figures:
    """Every figure of ours this large."""
    ours: Figures = {f"stability.{key}": size for key in ("mean_ms", "deviation_ms", "growth_mb")}
    for stage in ("stereo_ms", "estimation_ms", "filter_ms"):
        ours[f"timing.320x240.one-point-ransac.{stage}"] = size
    for kind in KINDS:
        for axis, unit in zip(AXES, ("mm", "mm", "deg"), strict=True):
            ours[f"{kind}.one-point-ransac.{axis}_average_{unit}"] = -size
        for key in (
            "position_mean_mm",
            "first_turn_deg",
            "position_end_percent",
            "heading_end_deg",
        ):
            ours[f"{kind}.one-point-ransac.{key}"] = size
    return paper_figures() | ours


@pytest.mark.parametrize(("size", "reached"), [(0.01, True), (1e6, False)])
def test_all_is_reached_or_nothing(size: float, reached: bool) -> None:
    told = summary_figures(figures(size))
    verdicts = {key: value for key, value in told.items() if key.startswith("verdict.")}
    assert len(verdicts) == told["summary.rows"] == 26
    assert set(verdicts.values()) == {float(reached)}
    assert told["summary.reached"] == (26 if reached else 0)


def test_signs_do_not_matter_and_one_axis_is_enough_to_miss() -> None:
    ours = figures(0.01) | {"linear_indoors.one-point-ransac.y_average_mm": -70.0}
    told = summary_figures(ours)
    assert told["verdict.linear_indoors"] == 0 and told["verdict.linear_outdoors"] == 1
    ours["linear_indoors.one-point-ransac.y_average_mm"] = 65.1
    assert summary_figures(ours)["verdict.linear_indoors"] == 1


def test_what_is_unknown_is_not_judged() -> None:
    ours = figures(0.01) | {"spot_turn_cement.one-point-ransac.first_turn_deg": None}
    told = summary_figures(ours)
    assert told["verdict.spot_turn_cement.first_turn_deg"] is None
    assert told["summary.reached"] == 25
