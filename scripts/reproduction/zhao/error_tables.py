"""Tables of errors: a row an estimator, the paper's own row first."""

from collections.abc import Sequence

from grouser.scripts.reproduction.page import Cell, Number, Row, Table, plus_minus
from grouser.scripts.reproduction.zhao.contenders import forms
from grouser.scripts.reproduction.zhao.errors import AXES, UNITS

PAPER = "the paper"

_DIGITS = {"mm": 1, "deg": 2}


def average_cell(prefix: str, axis: str) -> tuple[str | Number, ...]:
    """Average and deviation of an axis, of AXES."""
    unit = UNITS[AXES.index(axis)]
    return plus_minus(
        Number(f"{prefix}.{axis}_average_{unit}", _DIGITS[unit], signed=True),
        Number(f"{prefix}.{axis}_deviation_{unit}", _DIGITS[unit]),
    )


def error_table(
    caption: str,
    kind: str,
    names: Sequence[str],
    *,
    axes: Sequence[str],
    more: Sequence[tuple[str, str, int]],
) -> Table:
    """The errors of one kind of course.

    Args:
        kind: what the figures' names begin with.
        names: of the estimators.
        axes: those that the paper tells.
        more: heading, figure and digits of further columns, which the paper does not have.
    """
    columns = [
        "estimator",
        *(f"{axis}, {UNITS[AXES.index(axis)]}" for axis in axes),
        *(heading for heading, _, _ in more),
    ]
    paper: list[Cell] = [average_cell(f"paper.{kind}", axis) for axis in axes]
    rows = [Row(PAPER, [*paper, *([""] * len(more))], from_paper=True)]
    for name in names:
        prefix = f"{kind}.{name}"
        cells: list[Cell] = [average_cell(prefix, axis) for axis in axes]
        cells += [Number(f"{prefix}.{figure}", digits) for _, figure, digits in more]
        rows.append(Row(name, cells, stressed=name in forms(names)))
    return Table(caption, columns, rows)
