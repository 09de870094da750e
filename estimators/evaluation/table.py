"""Runs as a table for the terminal: a row an estimator, averaged over its runs."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from rich import box
from rich.table import Table

from grouser.estimators.evaluation.summary import WARM_UP_UPDATES, Summary


@dataclass(frozen=True, slots=True)
class _Column:
    heading: str
    key: str
    digits: int
    scale: float = 1.0


_COLUMNS = (
    _Column("dist.\nm", "distance_m", 1),
    _Column("ATE\nm", "ate_m", 3),
    _Column("final\nm", "final_error_m", 3),
    _Column("final\ndeg", "final_heading_error_deg", 2),
    _Column("drift\n%", "drift_percent", 2),
    _Column("drift\ndeg/m", "drift_deg_per_m", 3),
    _Column("3-D\n%", "drift_percent_3d", 2),
    _Column("NEES", "nees_mean", 1),
    _Column("track\n%", "tracking_fraction", 0, 100.0),
    _Column("lost\n%", "lost_fraction", 0, 100.0),
    _Column("ms", "ms_per_frame_median", 2),
    _Column("ms\np95", "ms_per_frame_p95", 2),
)
_COLUMN_WIDTH = 5
# The first of these are left out first where the table would be too wide: it would be cropped.
_DISPENSABLE = (
    "ms_per_frame_p95",
    "drift_percent_3d",
    "lost_fraction",
    "distance_m",
    "drift_deg_per_m",
    "ate_m",
)


def results_table(summaries: list[Summary], title: str, *, width: int | None = None) -> Table:
    """The table; a figure that no run has is a dash.

    Where it would exceed `width` characters, figures are left out, and the caption says which.
    """
    names = list(dict.fromkeys(s["estimator"] for s in summaries))
    left_out = _left_out(names, width)
    columns = [column for column in _COLUMNS if column.key not in left_out]
    table = Table(
        title=title,
        caption=_caption(summaries, left_out),
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        padding=0,
    )
    table.add_column("estimator", no_wrap=True)
    for column in columns:
        table.add_column(column.heading, justify="right", no_wrap=True, min_width=_COLUMN_WIDTH)
    for name in names:
        runs = [s for s in summaries if s["estimator"] == name]
        table.add_row(name, *(_cell(runs, column) for column in columns))
    return table


def _left_out(names: list[str], width: int | None) -> tuple[str, ...]:
    """Keys of the figures for which there is no room."""
    if width is None:
        return ()
    first = max(map(len, ("estimator", *names)))
    room = (width - first - 2) // (_COLUMN_WIDTH + 1)  # an edge each side, a space between
    return _DISPENSABLE[: max(0, len(_COLUMNS) - room)]


def _caption(summaries: list[Summary], left_out: tuple[str, ...]) -> str:
    runs: Callable[[str], int] = [s["estimator"] for s in summaries].count
    most = max((runs(s["estimator"]) for s in summaries), default=0)
    mean = f"Means over {most} runs. " if most > 1 else ""
    narrow = f" Only in results.json, for want of width: {', '.join(left_out)}." if left_out else ""
    return (
        f"{mean}ATE aligned by SE(2), no scale; drift over segments of 5 to 40 m; NEES: 3 is "
        f"honest; ms a frame: update alone, without the first {WARM_UP_UPDATES}.{narrow}"
    )


def _cell(runs: list[Summary], column: _Column) -> str:
    values = [run[column.key] for run in runs if run[column.key] is not None]
    return _number(column.scale * float(np.mean(values)), column.digits) if values else "-"


def _number(value: float, digits: int) -> str:
    """As many digits as asked for, or fewer, to fit into five characters up to 99999."""
    before_point = len(f"{abs(value):.0f}")
    return f"{value:.{max(0, min(digits, 4 - before_point))}f}"
