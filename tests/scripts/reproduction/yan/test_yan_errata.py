"""What is printed and what is right, against what SPEC 2.1 says of them."""

import numpy as np
import pytest

from grouser.scripts.reproduction.yan.errata import ErrataExperiment, errata_figures

FIGURES = errata_figures(ErrataExperiment(points=60).run(lambda: None))


def figure(name: str) -> float:
    value = FIGURES[f"errata.{name}"]
    assert value is not None
    return value


def test_what_is_right_is_exact() -> None:
    assert figure("worst_jacobian") < 1e-6
    assert figure("eq11.pose_and_row_1") < 1e-6
    assert figure("eq10.corrected_rad") < 1e-12
    assert figure("eq5.front_m_s") < 1e-5
    assert figure("foot.corrected") < 1e-20
    assert figure("half.corrected_m") < 1e-9
    assert figure("set.corrected_percent") == 100


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [
        ("eq5.rear_m_s", 1.49, 1.51),  # V sin a of 3 m/s and 30 degrees
        ("eq6.printed", 0.12, 0.15),  # 2 T V of 0.025 s and 3 m/s
        ("eq7.printed", 0.04, 0.051),  # 2 T
        ("eq10.printed_rad", 3.14, 3.15),
        ("eq11.printed", 0.05, 100),
        ("foot.printed", 10, 1e4),
        ("foot.singular", 14, 15),
        ("half.printed_m", 1, 60),
    ],
)
def test_what_is_printed_is_as_wrong_as_it_must_be(name: str, least: float, most: float) -> None:
    assert least < figure(name) < most


def test_the_distance_is_honest_with_the_innovations_covariance_alone() -> None:
    assert figure("eq13.corrected") == pytest.approx(2, abs=0.15)
    assert figure("eq13.corrected_refused_percent") == pytest.approx(1, abs=0.5)
    assert figure("eq13.printed") > 3
    assert figure("eq13.printed_refused_percent") > 5


def test_every_figure_is_finite() -> None:
    assert all(value is not None and np.isfinite(value) for value in FIGURES.values())
