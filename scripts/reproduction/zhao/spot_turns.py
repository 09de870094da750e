"""Spot turns on asphalt and on cement (paper fig. 10)."""

from collections.abc import Sequence

import numpy as np

from grouser.geometry import Array
from grouser.scripts.reproduction.drawing import finish, new_figure, styles
from grouser.scripts.reproduction.experiment import Outcome, Outcomes
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Element, Paragraph, Picture, Section
from grouser.scripts.reproduction.zhao.courses import spot_turns
from grouser.scripts.reproduction.zhao.error_tables import error_table
from grouser.scripts.reproduction.zhao.errors import (
    average_and_deviation,
    course_errors,
    turned,
)
from grouser.scripts.reproduction.zhao.scale import Scale

_MORE = (
    ("after the first turn, deg", "first_turn_deg", 2),
    ("a turn, on average, deg", "per_turn_deg", 2),
    ("position at the end, mm", "position_end_mm", 1),
)


def spot_turn_kinds(scale: Scale) -> dict[str, str]:
    """What figures' names begin with, and the course behind it."""
    return {course.name.replace("-", "_"): course.name for course in spot_turns(scale)}


def spot_turn_figures(outcomes: Outcomes, names: Sequence[str], scale: Scale) -> Figures:
    """Errors of every estimator on either ground."""
    figures: Figures = {}
    for kind, course in spot_turn_kinds(scale).items():
        outcome = outcomes[course]
        turns = float(abs(turned(outcome)[-1])) / (2 * np.pi)
        figures |= named(kind, {"frames": len(outcome["twist"]), "turns": turns})
        for name in names:
            errors = course_errors(outcome, name)
            values = average_and_deviation(errors) | {
                "first_turn_deg": _after_first_turn(outcome, errors),
                "per_turn_deg": float(abs(errors[-1, 2])) / turns,
                "position_end_mm": float(np.linalg.norm(errors[-1, :2])),
            }
            figures |= named(f"{kind}.{name}", values)
    return figures


def spot_turn_section(outcomes: Outcomes, names: Sequence[str], scale: Scale) -> Section:
    """A table and a trend for each ground."""
    elements: list[Element] = [
        Paragraph(
            "Turning to the left on the spot, {spot_turn_asphalt.turns:.2f} turns in "
            "{spot_turn_asphalt.frames:.0f} frames on the asphalt of a parking lot and "
            "{spot_turn_cement.turns:.2f} in {spot_turn_cement.frames:.0f} frames in a garden "
            "whose ground is all cement. The paper does not tell how often its robot turned."
        )
    ]
    for kind, course in spot_turn_kinds(scale).items():
        ground = course.rpartition("-")[2]
        caption = f"On {ground}: average and standard deviation of the heading's error."
        elements.append(error_table(caption, kind, names, axes=("heading",), more=_MORE))
        elements.append(_trend(outcomes[course], names, f"The paper's fig. 10, on {ground}."))
    return Section("Spot turns", elements)


def _after_first_turn(outcome: Outcome, errors: Array) -> float | None:
    """Size of the heading's error in the first frame after 360 degrees, deg."""
    around = np.flatnonzero(np.abs(turned(outcome)[1:]) >= 2 * np.pi)
    return float(abs(errors[around[0], 2])) if len(around) else None


def _trend(outcome: Outcome, names: Sequence[str], caption: str) -> Picture:
    figure, axes = new_figure(11, 3.4, 1, 2)
    frames, style = np.arange(len(outcome["true_pose"])), styles(names)
    angle, error = axes[0]
    angle.plot(frames, np.degrees(turned(outcome)), "k", lw=4, alpha=0.25, label="truth")
    for name in names:
        heading = np.degrees(np.unwrap(outcome[f"{name}.pose"][:, 2]))
        angle.plot(frames, heading, lw=1.2, **style[name])
        error.plot(frames[1:], course_errors(outcome, name)[:, 2], label=name, **style[name])
    error.set_yscale("symlog", linthresh=1.0)
    finish(angle, x="frame", y="deflection angle [deg]", legend=True)
    finish(error, x="frame", y="error of the heading [deg]")
    figure.legend(*error.get_legend_handles_labels(), loc="outside right", fontsize="small")
    return Picture(caption, figure)
