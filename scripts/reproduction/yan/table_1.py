"""Table 1, and what it would say of observers alone."""

import numpy as np

from grouser.scripts.reproduction.experiment import Outcomes
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Cell, Number, Paragraph, Row, Section, Table
from grouser.scripts.reproduction.yan.observer_times import OBSERVERS
from grouser.scripts.reproduction.yan.paper import ROWS, WORLDS
from grouser.scripts.reproduction.yan.scale import Scale

_KINDS = {"compiled": "observer-times", "interpreted": "observer-times-interpreted"}
_WORDS = {
    "bisection": "bisection, 1 mm",
    "points_0_1": "point by point, 0.1 m",
    "points_0_5": "point by point, 0.5 m",
    "closed": "closed form",
}
_UNITS = {"alone": ("ms", 1e3), "whole": ("s", 1.0)}
_RATIOS = ("points_0_1", "points_0_5", "closed")


def table_1_figures(outcomes: Outcomes, scale: Scale) -> Figures:
    """Times of each, and how many times longer than bisection they took, in the same rounds."""
    figures: Figures = {}
    for kind, experiment in _KINDS.items():
        outcome = outcomes[experiment]
        for scope in ("alone", "whole"):
            prefix = f"table1.{kind}.{scope}"
            # (worlds, rounds)
            times = {
                name: np.array([outcome[f"{world}.{name}.{scope}_s"] for world in WORLDS])
                for name in OBSERVERS
            }
            unit, per_second = _UNITS[scope]
            medians = {f"{n}_{unit}": per_second * np.median(times[n]) for n in OBSERVERS}
            figures |= named(prefix, medians)
            ratios = {
                f"{name}_over_bisection": np.median(times[name] / times["bisection"])
                for name in _RATIOS
            }
            figures |= named(prefix, ratios)
            figures[f"{prefix}.bisection_over_closed"] = float(
                np.median(times["bisection"] / times["closed"])
            )
    return figures | _rows(outcomes, scale)


def _rows(outcomes: Outcomes, scale: Scale) -> Figures:
    """The paper's six rows: a whole simulation each, compiled."""
    figures: Figures = {}
    outcome = outcomes[_KINDS["compiled"]]
    for world in WORLDS:
        for row in range(ROWS):
            prefix = f"table1.{world}_{row + 1}"
            values = {
                f"{name}_s": _nth(outcome[f"{world}.{name}.whole_s"], row) for name in OBSERVERS
            }
            figures |= named(prefix, values)
    return figures


def table_1_section() -> Section:
    """The paper's table, then the observers by themselves."""
    return Section("How long it takes", [Paragraph(_TEXT), _simulations(), _by_themselves()])


_TEXT = (
    "Table 1 of the paper has the times of whole simulations; point by point took "
    "{paper.table1.ratio:.1f} times as long as bisection, at a spacing that is not told. Here a "
    "simulation is the vehicle, the sensor at every step and the filter. The observer is compiled, "
    "and so fast that no way of observing matters: four lines are seen in microseconds. The same "
    "code interpreted, as MATLAB interpreted the paper's, shows what the paper saw, as far as the "
    "filter leaves it room. By itself the observer tells: bisection is far faster than point by "
    "point, as the paper says, but the closed form, which the paper avoids for its cost, is faster "
    "than bisection, and exact. Interpreted it gains less: it is written for processors that take "
    "several segments at once."
)


def _nth(values: np.ndarray, row: int) -> float:
    return float(values[row]) if row < len(values) else float("nan")


def _simulations() -> Table:
    rows = []
    for world, words in (("over_range", "over-range"), ("normal", "normal")):
        for row in range(1, ROWS + 1):
            paper, ours = f"paper.table1.{world}_{row}", f"table1.{world}_{row}"
            cells: list[Cell] = [
                Number(f"{paper}.bisection_s", 2),
                Number(f"{paper}.points_s", 2),
                Number(f"{paper}.ratio", 2),
                *(Number(f"{ours}.{name}_s", 2) for name in OBSERVERS),
            ]
            rows.append(Row(words, cells))
    headings = ["run", "paper: bisection, s", "paper: point by point, s", "paper: ratio"]
    return Table(
        "Table 1: seconds of a whole simulation. Ours compiled, in turns, on one core.",
        [*headings, *(f"{words}, s" for words in _WORDS.values())],
        rows,
        paper_columns=(1, 2, 3),
    )


def _by_themselves() -> Table:
    rows = []
    for name, words in _WORDS.items():
        cells: list[Cell] = []
        for kind in _KINDS:
            for scope, (unit, _) in _UNITS.items():
                prefix = f"table1.{kind}.{scope}"
                cells.append(Number(f"{prefix}.{name}_{unit}", 2))
                ratio = f"{prefix}.{name}_over_bisection"
                cells.append(Number(ratio, 2) if name in _RATIOS else "")
        rows.append(Row(words, cells))
    columns = [""]
    for kind in _KINDS:
        columns += [f"{kind}: alone, ms", "over bisection", "whole, s", "over bisection"]
    return Table(
        "Alone: all observations of a drive in one call (four lines, from the place after every "
        "step). Whole: a simulation, with the observer in it. Medians of both worlds' rounds, and "
        "how many times as long as by bisection.",
        columns,
        rows,
    )
