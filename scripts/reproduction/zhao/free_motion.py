"""Free motion, indoors and outdoors (paper figs. 8 and 11, table 2)."""

from collections.abc import Sequence

import numpy as np

from grouser.geometry import Array
from grouser.scripts.reproduction.drawing import finish, new_figure, styles
from grouser.scripts.reproduction.experiment import Outcome, Outcomes
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Element, Paragraph, Picture, Section
from grouser.scripts.reproduction.zhao.courses import free_indoors, free_outdoors
from grouser.scripts.reproduction.zhao.error_tables import error_table
from grouser.scripts.reproduction.zhao.errors import (
    AXES,
    average_and_deviation,
    course_errors,
    distance,
    sizes,
)
from grouser.scripts.reproduction.zhao.scale import Scale

INDOORS = "free_indoors"

_MORE = (
    ("position, mean, % of the way", "position_mean_percent", 3),
    ("position at the end, %", "position_end_percent", 3),
    ("heading at the end, deg", "heading_end_deg", 2),
)


def outdoor_kinds(scale: Scale) -> dict[str, str]:
    """What figures' names begin with, and the course behind it."""
    return {course.name.replace("-", "_"): course.name for course in free_outdoors(scale)}


def free_figures(outcomes: Outcomes, names: Sequence[str], scale: Scale) -> Figures:
    """Errors of every estimator: indoors over all sets, outdoors of each set, as the paper has."""
    indoors = [course.name for course in free_indoors(scale)]
    figures = _figures(INDOORS, [outcomes[name] for name in indoors], names)
    for kind, course in outdoor_kinds(scale).items():
        figures |= _figures(kind, [outcomes[course]], names)
    return figures


def free_section(outcomes: Outcomes, names: Sequence[str], scale: Scale) -> Section:
    """Tables, ways from above and errors over the distance."""
    elements: list[Element] = [
        Paragraph(
            "An operator drives through the goals of a world and back. Indoors "
            "{free_indoors.sets:.0f} sets of {free_indoors.frames:.0f} frames "
            "({free_indoors.distance_m:.1f} m on average); the paper tells neither frames nor "
            "metres. Outdoors the paper's three sets: {free_outdoors_1.frames:.0f} frames on a "
            "parking lot ({free_outdoors_1.distance_m:.1f} m), {free_outdoors_2.frames:.0f} in a "
            "garden ({free_outdoors_2.distance_m:.1f} m) and {free_outdoors_3.frames:.0f} in an "
            "orchard ({free_outdoors_3.distance_m:.1f} m)."
        ),
        error_table("Indoors.", INDOORS, names, axes=AXES, more=_MORE),
        _ways(
            outcomes[free_indoors(scale)[0].name],
            names,
            "The paper's fig. 8: one set indoors from above, and the errors over the way.",
        ),
    ]
    for number, (kind, course) in enumerate(outdoor_kinds(scale).items(), 1):
        caption = f"Outdoors, set {number} of the paper's table 2."
        elements.append(error_table(caption, kind, names, axes=AXES, more=_MORE))
        elements.append(_ways(outcomes[course], names, f"The paper's fig. 11, set {number}."))
    return Section("Free motion", elements)


def _figures(kind: str, sets: list[Outcome], names: Sequence[str]) -> Figures:
    driven = np.array([distance(outcome) for outcome in sets])
    frames = float(np.mean([len(outcome["twist"]) for outcome in sets]))
    about = {"sets": len(sets), "distance_m": float(driven.mean()), "frames": frames}
    figures = named(kind, about)
    for name in names:
        errors = [course_errors(outcome, name) for outcome in sets]
        values = average_and_deviation(np.concatenate(errors)) | sizes(errors)
        values["position_mean_percent"] = _percent([_lengths(e).mean() for e in errors], driven)
        values["position_end_percent"] = _percent([_lengths(e)[-1] for e in errors], driven)
        figures |= named(f"{kind}.{name}", values)
    return figures


def _lengths(errors: Array) -> Array:
    """(n,) of the position's errors (n, 3), mm."""
    return np.asarray(np.linalg.norm(errors[:, :2], axis=1))


def _percent(errors_mm: list[float], driven: Array) -> float:
    """Mean of the errors over the ways [m]; NaN where a robot only turned."""
    if not driven.all():
        return np.nan
    return float(np.mean(np.array(errors_mm) / 1e3 / driven) * 100)


def _ways(outcome: Outcome, names: Sequence[str], caption: str) -> Picture:
    figure, axes = new_figure(11, 4.6, 1, 2)
    style, truth = styles(names), outcome["true_pose"]
    above, error = axes[0]
    steps = np.linalg.norm(np.diff(truth[:, :2], axis=0), axis=1)
    along = np.cumsum(steps)
    above.plot(*truth[:, :2].T, "k", lw=4, alpha=0.25, label="truth")
    for name in names:
        above.plot(*outcome[f"{name}.pose"][:, :2].T, lw=1.1, **style[name])
        away = _lengths(course_errors(outcome, name))
        error.plot(along, away, lw=1.2, label=name, **style[name])
    margin = 1.0
    above.set_xlim(truth[:, 0].min() - margin, truth[:, 0].max() + margin)
    above.set_ylim(truth[:, 1].min() - margin, truth[:, 1].max() + margin)
    above.set_aspect("equal")
    error.set_yscale("log")
    finish(above, x="x [m]", y="y [m]", legend=True)
    finish(error, x="way [m]", y="error of the position [mm]")
    figure.legend(*error.get_legend_handles_labels(), loc="outside right", fontsize="small")
    return Picture(caption, figure)
