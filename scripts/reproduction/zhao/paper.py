"""The numbers that the paper printed, by the names under which ours stand beside them."""

from grouser.scripts.reproduction.figures import Figures, named

RESOLUTIONS = ((640, 480), (512, 384), (400, 300), (320, 240), (256, 192))
"""Of table 1, px."""

_TABLE_1 = (
    (48.969, 0.874, 0.161),
    (39.851, 0.664, 0.157),
    (31.970, 0.754, 0.158),
    (22.165, 0.662, 0.168),
    (22.460, 0.610, 0.153),
)
"""ms: binocular stereo vision processing, parameter estimation, Kalman filtering."""

_TABLE_2 = (
    (47.1, 36.4, 268.4, 287.7, 2.32, 2.57),
    (-326.2, 818.1, -1057.3, 950.6, 16.68, 5.32),
    (-25.4, 135.8, -131.9, 115.1, 2.43, 3.68),
)
"""Of each set: average and standard deviation of x [mm], y [mm] and heading [deg]."""


def size_name(size: tuple[int, int]) -> str:
    """Such as 320x240."""
    return f"{size[0]}x{size[1]}"


def paper_figures() -> Figures:
    """All of them."""
    figures: Figures = {}
    for size, (stereo, estimation, kalman) in zip(RESOLUTIONS, _TABLE_1, strict=True):
        times = {"stereo_ms": stereo, "estimation_ms": estimation, "filter_ms": kalman}
        figures |= named(f"paper.timing.{size_name(size)}", times)
    figures |= named("paper.stability", {"mean_ms": 26.5511, "deviation_ms": 4.551})
    figures |= _errors("linear_indoors", -31.5, 22.6, -65.2, 16.0)
    figures |= _errors("linear_outdoors", 15.8, 53.0, 124.5, 40.3)
    figures |= _errors("free_indoors", -1.5, 47.4, 7.4, 8.5, 0.05, 0.56)
    for number, row in enumerate(_TABLE_2, 1):
        figures |= _errors(f"free_outdoors_{number}", *row)
    figures |= _heading("spot_turn_asphalt", 6.38, 6.38)
    figures |= _heading("spot_turn_cement", 4.09, 8.17)
    return figures


def _errors(kind: str, *values: float) -> Figures:
    """Average and deviation of x, of y, and of the heading where the paper tells it."""
    x, x_sd, y, y_sd, *heading = values
    along = {"x_average_mm": x, "x_deviation_mm": x_sd}
    across = {"y_average_mm": y, "y_deviation_mm": y_sd}
    figures = named(f"paper.{kind}", along | across)
    return figures | (_heading(kind, *heading) if heading else {})


def _heading(kind: str, average: float, deviation: float) -> Figures:
    values = {"heading_average_deg": average, "heading_deviation_deg": deviation}
    return named(f"paper.{kind}", values)
