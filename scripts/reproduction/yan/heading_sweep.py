"""How sure the filters are of what nobody can see: NEES and NIS over time, and against how well
the heading of the start is known."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from grouser.geometry import Array
from grouser.scripts.reproduction.drawing import finish, new_figure, styles
from grouser.scripts.reproduction.experiment import Outcome, Outcomes
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Cell, Number, Paragraph, Picture, Row, Section, Table
from grouser.scripts.reproduction.yan.contests import contest_name
from grouser.scripts.reproduction.yan.forms import CORRECTED, FORMS, PRINTED
from grouser.scripts.reproduction.yan.honesty import bounds, leaves_at
from grouser.scripts.reproduction.yan.monte_carlo import MonteCarlo, blocks
from grouser.scripts.reproduction.yan.paper import WORLDS
from grouser.scripts.reproduction.yan.scale import Scale

_WORLD = "normal"
_DOF, _LINE_DOF = 3, 2
_SHOWN_DEG = 10.0
"""At which NEES over time is drawn, besides that of the exact start."""

_SWEPT = {name: form for name, form in FORMS.items() if name != PRINTED}
"""The printed form is not honest even where the start is known exactly."""

_MEASURES = {"nees": "differences", "plane_nees": "the plane's motion"}


def sweep_experiments(scale: Scale) -> list[MonteCarlo]:
    """At each heading uncertainty; the exact start is among the contests."""
    return [
        block
        for deg in scale.start_sigmas_deg
        if deg
        for block in blocks(_name(deg), WORLDS[_WORLD], _SWEPT, scale.runs, float(np.radians(deg)))
    ]


def sweep_figures(outcomes: Outcomes, scale: Scale) -> Figures:
    """NEES at every heading uncertainty, and where it leaves its bounds."""
    low, high = bounds(_DOF * scale.runs, scale.runs)
    figures: Figures = named(
        "monte_carlo",
        {
            "runs": scale.runs,
            "nees_low": low,
            "nees_high": high,
            "largest_deg": max(scale.start_sigmas_deg),
            "shown_deg": _SHOWN_DEG,
        },
    )
    for form in FORMS:
        means: dict[str, list[float]] = {measure: [] for measure in _MEASURES}
        for deg in (amounts := _amounts(form, scale)):
            values = _level_values(outcomes[_name(deg)], form, low, high)
            figures |= named(f"heading_{deg:g}_deg.{form}", values)
            for measure in _MEASURES:
                means[measure].append(values[measure])
        left = {
            f"{measure}_leaves_at_deg": leaves_at(amounts, means[measure], low, high)
            for measure in _MEASURES
        }
        exact = outcomes[_name(0.0)]
        left["nis_inside_percent"] = 100 * _inside(*_nis(exact, form))
        figures |= named(f"honesty.{form}", left)
    return figures


def sweep_section(outcomes: Outcomes, scale: Scale) -> Section:
    """Over time where the start is exact, then against the heading's uncertainty."""
    return Section(
        "What the filters believe of themselves",
        [
            Paragraph(_TIME),
            _over_time_picture(outcomes, scale),
            Paragraph(_SWEEP),
            _sweep_table(scale),
            _sweep_picture(outcomes, scale),
            _honesty_table(),
        ],
    )


_TIME = (
    "The paper asks of its filter whether it is near; here is asked whether it knows how near. "
    "After every look of the sensor NEES and NIS are averaged over {monte_carlo.runs:.0f} drives; "
    "an honest filter's average lies inside the shaded bounds in 95 % of the looks. NIS cannot "
    "tell the printed Jacobians from the right ones: what the sensor shows next is where the "
    "filter expects it, for its map is as wrong as its pose."
)

_SWEEP = (
    "The paper's start is known exactly, and there all filters but the printed one are honest. A "
    "robot that wakes up somewhere does not know its heading in the world, and no look at lines "
    "of which it has no map can tell it: the uncertainty must stay. Here the filters are told how "
    "well the heading of the start is known, and the start is turned by so much at random. The "
    "error is then a turn of the whole plane about the start; of such errors, the places make up "
    "a sickle, which no covariance of differences in x and y describes. So NEES is also taken of "
    "the motion of the plane that takes the estimate to the truth. By that measure the standard "
    "filter leaves its bounds as soon as it comes to believe that it has seen the heading, "
    "first-estimates Jacobians hold as long as the first estimates are good enough to linearise "
    "at, and the right-invariant filter has no reason to leave. A dash: not up to "
    "{monte_carlo.largest_deg:.0f} degrees."
)


def _amounts(form: str, scale: Scale) -> list[float]:
    """Heading uncertainties [deg] at which a form was watched."""
    return [deg for deg in scale.start_sigmas_deg if form in _SWEPT or not deg]


def _name(deg: float) -> str:
    return f"heading-{deg:g}-deg" if deg else contest_name(_WORLD)


def _level_values(outcome: Outcome, form: str, low: float, high: float) -> dict[str, float]:
    over_time = np.nanmean(outcome[f"{form}.nees"], axis=0)
    return {
        "nees": float(np.nanmean(over_time)),
        "plane_nees": float(np.nanmean(outcome[f"{form}.plane_nees"])),
        "nees_inside_percent": 100 * _inside(over_time, low, high),
        "heading_sigma_end_deg": float(np.degrees(outcome[f"{form}.heading_sigma"][:, -1].mean())),
        "heading_rms_deg": float(np.degrees(np.sqrt((outcome[f"{form}.heading_rms"] ** 2).mean()))),
    }


def _nis(outcome: Outcome, form: str) -> tuple[Array, Array, Array]:
    """(looks,) NIS of a line, averaged over all lines of a look in all runs, and its bounds,
    where any was seen."""
    n = outcome[f"{form}.matched"].sum(axis=0)
    seen = n > 0
    mean = outcome[f"{form}.nis_sum"].sum(axis=0)[seen] / n[seen]
    limits = np.array([bounds(_LINE_DOF * count, int(count)) for count in n[seen]])
    return mean, limits[:, 0], limits[:, 1]


def _inside(values: Array, low: Any, high: Any) -> float:
    known = np.isfinite(values)
    return float(np.mean(((values >= low) & (values <= high))[known]))


def _over_time_picture(outcomes: Outcomes, scale: Scale) -> Picture:
    figure, axes = new_figure(11, 6.4, 2, 2)
    exact = outcomes[_name(0.0)]
    low, high = bounds(_DOF * scale.runs, scale.runs)
    stamps = exact[f"{CORRECTED}.stamps"][0]
    shown = outcomes[_name(_SHOWN_DEG)]
    panels: list[tuple[Any, str, Iterable[str], Callable[[str], Array]]] = [
        (axes[0, 0], "NEES, start known exactly", FORMS, lambda f: _mean(exact[f"{f}.nees"])),
        (axes[1, 0], f"NEES of differences, heading of the start to {_SHOWN_DEG:g} deg", _SWEPT,
         lambda f: _mean(shown[f"{f}.nees"])),
        (axes[1, 1], f"NEES of the plane's motion, {_SHOWN_DEG:g} deg", _SWEPT,
         lambda f: _mean(shown[f"{f}.plane_nees"])),
    ]  # fmt: skip
    style = styles(list(FORMS))
    for area, title, forms, values in panels:
        area.axhspan(low, high, color="k", alpha=0.12, lw=0)
        for form in forms:
            area.plot(stamps, values(form), lw=1.2, label=form, **style[form])
        area.set_yscale("log")
        finish(area, x="time [s]", y="NEES", title=title, legend=area is axes[0, 0])
    _nis_panel(axes[0, 1], exact)
    return Picture(
        "NEES and NIS over time, averages of {monte_carlo.runs:.0f} drives; shaded: what 95 % of "
        "an honest filter's averages lie in. Bounds of NIS follow the number of lines seen.",
        figure,
    )


def _nis_panel(area: Any, outcome: Outcome) -> None:
    for form, style in styles(list(FORMS)).items():
        mean, low, high = _nis(outcome, form)
        stamps = outcome[f"{form}.stamps"][0][outcome[f"{form}.matched"].sum(axis=0) > 0]
        if form == CORRECTED:
            area.fill_between(stamps, low, high, color="k", alpha=0.12, lw=0)
        area.plot(stamps, mean, lw=1.0, **style)
    area.set_ylim(0, 5)
    finish(area, x="time [s]", y="NIS of a line", title="NIS, start known exactly")


def _sweep_table(scale: Scale) -> Table:
    rows = []
    for form, contestant in FORMS.items():
        for measure, words in _MEASURES.items():
            watched = _amounts(form, scale)
            cells: list[Cell] = [
                Number(f"heading_{deg:g}_deg.{form}.{measure}", 1) if deg in watched else ""
                for deg in scale.start_sigmas_deg
            ]
            cells.append(Number(f"honesty.{form}.{measure}_leaves_at_deg", 1))
            rows.append(Row(f"{contestant.words}: {words}", cells))
    return Table(
        "NEES averaged over time and drives, by how well the heading of the start is known [deg], "
        "and where it leaves {monte_carlo.nees_low:.2f} to {monte_carlo.nees_high:.2f}, which "
        "hold 95 % of the averages of as many independent ones.",
        ["", *(f"{deg:g}" for deg in scale.start_sigmas_deg), "leaves at, deg"],
        rows,
    )


def _sweep_picture(outcomes: Outcomes, scale: Scale) -> Picture:
    figure, axes = new_figure(11, 3.4, 1, 3)
    low, high = bounds(_DOF * scale.runs, scale.runs)
    for form, style in styles(list(FORMS)).items():
        degrees = _amounts(form, scale)
        values = [_level_values(outcomes[_name(deg)], form, low, high) for deg in degrees]
        for area, key in zip(axes[0], ("nees", "plane_nees", "heading_sigma_end_deg"), strict=True):
            area.plot(degrees, [v[key] for v in values], marker="o", ms=3.5, label=form, **style)
    for area, title in zip(axes[0], ("differences", "the plane's motion"), strict=False):
        area.axhspan(low, high, color="k", alpha=0.12, lw=0)
        area.set_yscale("log")
        finish(area, x="heading of the start, sigma [deg]", y="NEES", title=title)
    ideal = [0.0, max(scale.start_sigmas_deg)]
    axes[0, 2].plot(ideal, ideal, "k", lw=4, alpha=0.2, label="what can be known")
    finish(
        axes[0, 2],
        x="heading of the start, sigma [deg]",
        y="sigma at the end [deg]",
        title="heading, as the filters believe",
        legend=True,
    )
    return Picture(
        "NEES by both measures, and the heading's standard deviation that the filters end with, "
        "against that of the start: what they fall below it, they believe to have seen.",
        figure,
    )


def _honesty_table() -> Table:
    rows = [
        Row(
            contestant.words,
            [
                Number(f"heading_0_deg.{form}.nees", 2),
                Number(f"heading_0_deg.{form}.nees_inside_percent", 0),
                Number(f"honesty.{form}.nis_inside_percent", 0),
            ],
        )
        for form, contestant in FORMS.items()
    ]
    return Table(
        "Where the start is known exactly: share of looks with the average of all drives inside "
        "its 95 % bounds. Looks follow closely on one another, so that shares go far up and down.",
        ["", "NEES", "NEES inside, %", "NIS inside, %"],
        rows,
    )


def _mean(values: Array) -> Array:
    return np.asarray(np.nanmean(values, axis=0))
