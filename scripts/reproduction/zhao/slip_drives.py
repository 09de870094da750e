"""Side slip as it was measured: estimators with 1, 2, 3 and 5 points on grounds that give way."""

from collections.abc import Sequence

import numpy as np

from grouser.estimators import registry
from grouser.geometry import Array
from grouser.scripts.reproduction.drawing import finish, new_figure, styles
from grouser.scripts.reproduction.experiment import Outcome, Outcomes
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Cell, Element, Number, Paragraph, Picture, Row, Table
from grouser.scripts.reproduction.zhao.course import Course
from grouser.scripts.reproduction.zhao.course_experiment import CourseExperiment, subjects
from grouser.scripts.reproduction.zhao.errors import course_errors, distance
from grouser.scripts.reproduction.zhao.manoeuvres import Circle, Manoeuvre, Tour
from grouser.scripts.reproduction.zhao.scale import Scale

_COMPARED = (
    "one-point-ransac",
    "one-point-paper",
    "two-point-ransac",
    "three-point-ransac",
    "five-point-ransac",
)
_SPEED = 0.4  # m/s
_STANDING = 0.05  # m/s: slower frames tell of no side slip

_DRIVES: dict[str, tuple[str, str, Manoeuvre, float]] = {
    "asphalt-wide": ("parking-lot", "asphalt", Circle(_SPEED, 1.5), 0.0),
    "asphalt-tight": ("parking-lot", "asphalt", Circle(_SPEED, 0.4), 0.0),
    "grass-tight": ("parking-lot", "grass", Circle(_SPEED, 0.4), 0.0),
    "mud-tight": ("parking-lot", "mud", Circle(_SPEED, 0.4), 0.0),
    "ice-tight": ("parking-lot", "ice", Circle(_SPEED, 0.4), 0.0),
    "grass-slopes": ("forest", "grass", Tour(), 0.3),
    "mud-slopes": ("forest", "mud", Tour(), 0.3),
    "ice-slopes": ("garden", "ice", Tour(), 0.5),
}
"""World, terrain, manoeuvre and difficulty, by name: on the level with circles, and on slopes,
where a robot that drives across slips down."""


def slip_subjects(names: Sequence[str]) -> tuple[str, ...]:
    """Those that take part and differ by their minimal solver."""
    known = registry.names()
    return tuple(name for name in _COMPARED if name in known and name in names)


def slip_experiments(names: Sequence[str], scale: Scale) -> list[CourseExperiment]:
    """One a ground."""
    watching = subjects(slip_subjects(names))
    return [
        CourseExperiment(
            Course(
                name=f"slip-{name}",
                world=world,
                terrain=terrain,
                manoeuvre=manoeuvre,
                difficulty=difficulty,
                frames=scale.slip_frames,
            ),
            watching,
        )
        for name, (world, terrain, manoeuvre, difficulty) in _DRIVES.items()
    ]


def slip_figures(outcomes: Outcomes, names: Sequence[str]) -> Figures:
    """Measured slip of every drive; inliers, drift and time of every estimator on it."""
    figures: Figures = {}
    for drive in _DRIVES:
        outcome = outcomes[f"slip-{drive}"]
        figures |= named(f"slip.{drive}", _measured(outcome))
        for name in slip_subjects(names):
            figures |= named(f"slip.{drive}.{name}", _told(outcome, name))
    return figures


def slip_elements(figures: Figures, names: Sequence[str]) -> list[Element]:
    """Curves and a table."""
    shown = slip_subjects(names)
    columns = ["drive", "side slip, %"]
    columns += [f"{name}: drift, %" for name in shown] + [f"{name}: inliers, %" for name in shown]
    columns += [f"{name}: ms" for name in shown]
    rows = []
    for drive in _by_slip(figures):
        key = f"slip.{drive}"
        cells: list[Cell] = [Number(f"{key}.side_percent", 2)]
        cells += [Number(f"{key}.{name}.drift_percent", 3) for name in shown]
        cells += [Number(f"{key}.{name}.inlier_percent", 1) for name in shown]
        cells += [Number(f"{key}.{name}.ms", 2) for name in shown]
        rows.append(Row(drive.replace("-", ", "), cells))
    return [
        Paragraph(
            "Simulated drives with images. Side slip is measured, not assumed: the mean speed of "
            "the track centre across the robot over its speed along. Drift is the error of the "
            "position at the end over the way; inliers are those of all matches that the refined "
            "motion agrees with; milliseconds are of the whole update, beside another process."
        ),
        _picture(figures, shown),
        Table("Drives, by their measured side slip.", columns, rows),
    ]


def _measured(outcome: Outcome) -> dict[str, float]:
    forward, left, rate = outcome["twist"].T
    moving = np.abs(forward) > _STANDING
    side = np.nan
    if moving.any():
        side = float(np.abs(left[moving]).sum() / np.abs(forward[moving]).sum())
    turning = np.isfinite(outcome["icr"]).all(axis=1)
    centre = float(np.median(np.abs(outcome["icr"][turning, 2]))) if turning.any() else np.nan
    return {
        "side_percent": 100 * side,
        "icr_ahead_mm": 1e3 * centre,
        "distance_m": distance(outcome),
        "turned_deg": float(np.degrees(np.abs(rate).sum() * _DT)),
    }


_DT = 0.1  # s, of the simulated robot's step


def _told(outcome: Outcome, name: str) -> dict[str, float]:
    error = course_errors(outcome, name)
    way = distance(outcome)
    matches, inliers = (outcome[f"{name}.{key}"][1:] for key in ("matches", "inliers"))
    return {
        # A share of no way is none: a few frames of a tour may all be a turn on the spot.
        "drift_percent": float(np.linalg.norm(error[-1, :2])) / 10 / way if way > 0.01 else np.nan,
        "heading_end_deg": float(abs(error[-1, 2])),
        "inlier_percent": 100 * _share(inliers, matches),
        "tracking_percent": 100 * float(outcome[f"{name}.tracking"][1:].mean()),
        "ms": float(np.median(outcome[f"{name}.ms"])),
    }


def _share(inliers: Array, matches: Array) -> float:
    known = np.isfinite(inliers) & (matches > 0)
    return float((inliers[known] / matches[known]).mean()) if known.any() else np.nan


def _by_slip(figures: Figures) -> list[str]:
    return sorted(_DRIVES, key=lambda drive: figures[f"slip.{drive}.side_percent"] or 0.0)


def _picture(figures: Figures, shown: Sequence[str]) -> Picture:
    figure, axes = new_figure(11, 3.4, 1, 2)
    style, order = styles(shown), _by_slip(figures)
    order = [drive for drive in order if figures[f"slip.{drive}.side_percent"] is not None]
    slip = [figures[f"slip.{drive}.side_percent"] for drive in order]
    for name in shown:
        for area, key in zip(axes[0], ("drift_percent", "inlier_percent"), strict=True):
            told = [figures[f"slip.{drive}.{name}.{key}"] for drive in order]
            values = [np.nan if value is None else value for value in told]
            area.plot(slip, values, marker="o", ms=4, label=name, **style[name])
    finish(axes[0, 0], x="measured side slip [%]", y="drift [%]", legend=True)
    finish(axes[0, 1], x="measured side slip [%]", y="inliers [%]")
    return Picture("Drift and inliers against the measured side slip.", figure)
