"""Where one point loses: minimal solvers against the ratio of outliers and against side slip."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from grouser.geometry import Array
from grouser.scripts.reproduction.drawing import finish, new_figure, styles
from grouser.scripts.reproduction.experiment import Outcome, Outcomes
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Element, Number, Paragraph, Picture, Row, Table
from grouser.scripts.reproduction.zhao.solver_trials import (
    OUTLIER_RATIOS,
    SIDE_SLIPS,
    compared,
)

_GOOD_TURN = np.radians(0.2)
_GOOD_PLACE = 0.01  # m
_BEHIND = 1.15  # times the best rival's error: less is chance

_CURVES = {"outliers": OUTLIER_RATIOS, "slip": SIDE_SLIPS}
_ONE_POINT = "one-point"


def solver_figures(outcomes: Outcomes) -> Figures:
    """Means of every solver at every amount, and from where on one point is behind."""
    figures: Figures = {}
    for curve, amounts in _CURVES.items():
        outcome = outcomes[f"solvers-{curve}"]
        for name in compared():
            for row, amount in enumerate(amounts):
                prefix = f"solvers.{curve}.{_percent(amount)}.{name}"
                figures |= named(prefix, _means(outcome, name, row))
        figures |= named(f"solvers.{curve}", _losses(outcome, amounts))
    return figures


def solver_elements(outcomes: Outcomes) -> list[Element]:
    """Curves and tables."""
    elements: list[Element] = []
    for curve, (words, x) in _WORDS.items():
        amounts = _CURVES[curve]
        elements += [
            Paragraph(words),
            _picture(outcomes[f"solvers-{curve}"], amounts, x),
            _table(curve, amounts),
        ]
    return elements


_WORDS = {
    "outliers": (
        "Synthetic matches: 64 points, 0.3 px of noise, level camera at 320 \N{MULTIPLICATION SIGN}"
        " 240; turn and chord at random, no side slip. A hypothesis is right when it is within 0.2 "
        "degrees and 10 mm after the refinement that all share. With a sample of one, every match "
        "is tried; that wins against outliers at any ratio up to 80 %: its success is the highest "
        "or within 2 % of it up to {solvers.outliers.success_behind_percent:.0f} % (a dash: "
        "throughout), and its error within 15 % of the smallest up to "
        "{solvers.outliers.error_behind_percent:.0f} %.",
        "outlier ratio",
    ),
    "slip": (
        "The same with 20 % of outliers, and a side slip that the one-point solution takes not to "
        "exist. It loses inliers with the slip: from {solvers.slip.recall_behind_percent:.0f} % of "
        "side slip on, another solver keeps at least 2 % more of them. The refinement, in which "
        "side slip has a sigma instead of being ruled out, makes up for that: its error is behind "
        "from {solvers.slip.error_behind_percent:.0f} % on (a dash: never).",
        "side slip over chord",
    ),
}


def _means(outcome: Outcome, name: str, row: int) -> dict[str, float]:
    values = {key: outcome[f"{name}.{key}"][row] for key in _KEYS}
    return {
        "success_percent": 100 * float(_right(outcome, name)[row].mean()),
        "recall_percent": 100 * float(np.mean(values["recall"])),
        "precision_percent": 100 * _mean(values["precision"]),
        "turn_error_deg": float(np.degrees(_median(values["turn_error"]))),
        "place_error_mm": 1e3 * _median(values["place_error"]),
        "ms": float(np.median(values["ms"])),
    }


_KEYS = ("recall", "precision", "turn_error", "place_error", "ms")


def _losses(outcome: Outcome, amounts: Array) -> dict[str, float | None]:
    """The first amounts [%] at which one point is behind the best of the others."""
    others = [name for name in compared() if name != _ONE_POINT]
    success = {name: _right(outcome, name).mean(axis=1) for name in compared()}
    recall = {name: outcome[f"{name}.recall"].mean(axis=1) for name in compared()}
    error = {name: _medians(outcome[f"{name}.turn_error"]) for name in compared()}
    return {
        "success_behind_percent": _first(
            amounts, [success[name] > success[_ONE_POINT] + 0.02 for name in others]
        ),
        "recall_behind_percent": _first(
            amounts, [recall[name] > recall[_ONE_POINT] + 0.02 for name in others]
        ),
        "error_behind_percent": _first(
            amounts, [_BEHIND * error[name] < error[_ONE_POINT] for name in others]
        ),
    }


def _first(amounts: Array, behind: Sequence[NDArray[np.bool_]]) -> float | None:
    where = np.flatnonzero(np.any(behind, axis=0)) if behind else np.empty(0, int)
    return 100 * float(amounts[where[0]]) if len(where) else None


def _right(outcome: Outcome, name: str) -> NDArray[np.bool_]:
    """(amount, trial) whether the refined motion is; what was not found is not."""
    turn = np.nan_to_num(outcome[f"{name}.turn_error"], nan=np.inf)
    place = np.nan_to_num(outcome[f"{name}.place_error"], nan=np.inf)
    return np.asarray((turn < _GOOD_TURN) & (place < _GOOD_PLACE))


def _medians(values: Array) -> Array:
    """(amount,) where something was found; infinity where nothing ever was."""
    return np.array([_median(row) for row in values])


def _median(values: Array) -> float:
    found = values[np.isfinite(values)]
    return float(np.median(found)) if len(found) else np.inf


def _mean(values: Array) -> float:
    found = values[np.isfinite(values)]
    return float(found.mean()) if len(found) else np.nan


def _percent(amount: float) -> str:
    return f"{100 * amount:.0f}"


def _picture(outcome: Outcome, amounts: Array, x: str) -> Picture:
    figure, axes = new_figure(11, 3.2, 1, 4)
    style = styles(compared())
    rows = range(len(amounts))
    for name in compared():
        means = [_means(outcome, name, row) for row in rows]
        for area, key in zip(axes[0], _DRAWN, strict=True):
            area.plot(amounts, [m[key] for m in means], marker="o", ms=3, label=name, **style[name])
    for area, label in zip(axes[0], _DRAWN.values(), strict=True):
        finish(area, x=x, y=label)
    axes[0, 3].set_yscale("log")
    axes[0, 2].set_ylim(bottom=0)
    axes[0, 0].legend(fontsize="small")
    return Picture(f"Minimal solvers against the {x}.", figure)


_DRAWN = {
    "success_percent": "right motions [%]",
    "recall_percent": "inliers found [%]",
    "turn_error_deg": "median error of the turn [deg]",
    "ms": "time of the solver [ms]",
}


def _table(curve: str, amounts: Array) -> Table:
    names = compared()
    columns = [f"{curve}, %"]
    columns += [f"{name}: right, %" for name in names]
    columns += [f"{name}: inliers, %" for name in names]
    columns += [f"{name}: ms" for name in names]
    rows = []
    for amount in amounts:
        prefix = f"solvers.{curve}.{_percent(amount)}"
        cells = [Number(f"{prefix}.{name}.success_percent", 1) for name in names]
        cells += [Number(f"{prefix}.{name}.recall_percent", 1) for name in names]
        cells += [Number(f"{prefix}.{name}.ms", 3) for name in names]
        rows.append(Row(_percent(amount), cells))
    return Table("The same in numbers.", columns, rows)
