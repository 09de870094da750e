"""Linear motion, indoors and outdoors: out, and back in reverse (paper figs. 7 and 9)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from grouser.scripts.reproduction.drawing import finish, new_figure, styles
from grouser.scripts.reproduction.experiment import Outcome, Outcomes
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Element, Paragraph, Picture, Section
from grouser.scripts.reproduction.zhao.courses import linear_indoors, linear_outdoors
from grouser.scripts.reproduction.zhao.error_tables import error_table
from grouser.scripts.reproduction.zhao.errors import (
    average_and_deviation,
    course_errors,
    distance,
    sizes,
)
from grouser.scripts.reproduction.zhao.scale import Scale

_KINDS = {"linear_indoors": linear_indoors, "linear_outdoors": linear_outdoors}
_MORE = (
    ("position, mean mm", "position_mean_mm", 1),
    ("position at the end, mm", "position_end_mm", 1),
    ("heading, mean deg", "heading_mean_deg", 3),
)


def linear_figures(outcomes: Outcomes, names: Sequence[str], scale: Scale) -> Figures:
    """Errors of every estimator over all sets, and how far the robot went."""
    figures: Figures = {}
    for kind, courses in _KINDS.items():
        sets = [outcomes[course.name] for course in courses(scale)]
        driven = float(np.mean([distance(outcome) for outcome in sets]))
        frames = float(np.mean([len(outcome["twist"]) for outcome in sets]))
        figures |= named(kind, {"sets": len(sets), "distance_m": driven, "frames": frames})
        for name in names:
            errors = [course_errors(outcome, name) for outcome in sets]
            values = average_and_deviation(np.concatenate(errors)) | sizes(errors)
            figures |= named(f"{kind}.{name}", values)
    return figures


def linear_section(outcomes: Outcomes, names: Sequence[str], scale: Scale) -> Section:
    """Tables and trends."""
    indoors, outdoors = (courses(scale)[0].name for courses in _KINDS.values())
    elements: list[Element] = [
        Paragraph(
            "Half of the frames straight on, the other half back in reverse. Indoors "
            "{linear_indoors.sets:.0f} sets of {linear_indoors.frames:.0f} frames in furnished "
            "rooms, {linear_indoors.distance_m:.1f} m each; outdoors {linear_outdoors.sets:.0f} "
            "sets of {linear_outdoors.frames:.0f} frames on asphalt, in a garden and in an "
            "orchard, {linear_outdoors.distance_m:.1f} m each. The paper does not say how far its "
            "robot went, nor of what its averages are; ours are of all frames of all sets, "
            "estimate minus truth, x along the heading of the start."
        ),
        error_table("Indoors.", "linear_indoors", names, axes=("x", "y"), more=_MORE),
        _trends(
            outcomes[indoors],
            names,
            "The paper's fig. 7: the displacement of one set indoors, and its error.",
        ),
        error_table("Outdoors.", "linear_outdoors", names, axes=("x", "y"), more=_MORE),
        _trends(
            outcomes[outdoors],
            names,
            "The paper's fig. 9: the same of one set outdoors.",
        ),
    ]
    return Section("Linear motion", elements)


def _trends(outcome: Outcome, names: Sequence[str], caption: str) -> Picture:
    figure, axes = new_figure(11, 6.2, 2, 2)
    frames = np.arange(len(outcome["true_pose"]))
    style = styles(names)
    for k, axis in enumerate("xy"):
        axes[0, k].plot(frames, outcome["true_pose"][:, k], "k", lw=4, alpha=0.25, label="truth")
        for name in names:
            axes[0, k].plot(frames, outcome[f"{name}.pose"][:, k], lw=1.2, **style[name])
            error = course_errors(outcome, name)[:, k]
            axes[1, k].plot(frames[1:], error, lw=1.2, label=name, **style[name])
        finish(axes[0, k], x="", y=f"{axis} [m]", legend=k == 0)
        finish(axes[1, k], x="frame", y=f"error of {axis} [mm]")
    _stretch(axes)
    figure.legend(*axes[1, 0].get_legend_handles_labels(), loc="outside right", fontsize="small")
    return Picture(caption, figure)


def _stretch(axes: Any) -> None:
    """Across a straight course there is next to nothing: show millimetres, not their noise.
    Errors are drawn by their logarithm beyond a centimetre, for estimators differ by decades."""
    low, high = axes[0, 1].get_ylim()
    axes[0, 1].set_ylim(min(low, -0.1), max(high, 0.1))
    for k in range(2):
        axes[1, k].set_yscale("symlog", linthresh=10.0)
