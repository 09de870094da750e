"""What is printed and what is right, against the figures that SPEC 1.1 to 1.4 give."""

import numpy as np
import pytest

from grouser.scripts.reproduction.zhao.errata import ErrataExperiment, errata_figures

FIGURES = errata_figures(ErrataExperiment(runs=100).run(lambda: None))


def figure(name: str) -> float:
    value = FIGURES[f"errata.{name}"]
    assert value is not None
    return value


@pytest.mark.parametrize(
    ("name", "spec", "tolerance"),
    [
        ("eq2.printed_percent", 4.3, 0.1),  # sinc(1/2): "4 % at 1 rad"
        ("eq4.printed", 0.857, 0.001),
        ("offset.printed_percent", 10.0, 0.1),  # a = 0.2 m at 2 m
        ("eq14.noise_printed_deg", 3.2, 0.2),
        ("eq14.noise_corrected_deg", 0.76, 0.03),
        ("eq16.printed_m", 6.4, 0.2),  # about twice the depth
        ("eq17.at_2m_printed_mm", 77, 2),
        ("eq17.at_5m_printed_mm", 480, 12),
        ("eq17.at_2m_corrected_mm", 10.5, 0.3),
        ("eq17.at_5m_corrected_mm", 26, 1),
        ("eq20.horizon_printed_percent", 73, 3),
        ("eq20.epipole_printed_percent", 82, 4),
        ("eq20.horizon_corrected_percent", 5, 1),
        ("eq20.epipole_corrected_percent", 5, 1),
        ("eq21.corrected_times", 1, 0.05),
    ],
)
def test_figures_are_those_of_the_spec(name: str, spec: float, tolerance: float) -> None:
    assert figure(name) == pytest.approx(spec, abs=tolerance)


def test_what_is_right_is_exact() -> None:
    for name in ("eq12.error_rad", "eq14.error_rad", "eq14.at_infinity_rad", "eq21.residual_m"):
        assert figure(name) < 1e-14
    for name in ("eq14.offset_corrected_rad", "eq18.corrected"):
        assert figure(name) < 1e-13
    assert figure("eq16.corrected_m") == pytest.approx(0.1, abs=1e-12)
    assert abs(figure("eq2.corrected_percent")) < 1e-8
    assert figure("eq4.corrected") == pytest.approx(1, abs=1e-12)
    assert figure("eq4.half_width") == pytest.approx(1, abs=1e-12)
    assert figure("eq10.corrected") < 1e-8 < 0.1 < figure("eq10.printed")
    assert figure("eq18.printed") > 0.01


def test_the_covariance_with_jacobians_is_honest_and_the_printed_one_is_not() -> None:
    assert figure("eq9.corrected_nees") < 7  # 20 % of noise bends the distribution
    assert figure("eq9.printed_nees") > 50 * figure("eq9.corrected_nees")


def test_the_noise_of_eq_21_grows_with_the_square_of_the_depth() -> None:
    assert 20 < figure("eq21.printed_times") < 32


def test_every_figure_is_finite() -> None:
    assert all(value is not None and np.isfinite(value) for value in FIGURES.values())
