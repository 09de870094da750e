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


def results_table(summaries: list[Summary], title: str) -> Table:
    """The table; a figure that no run has is a dash."""
    table = Table(
        title=title,
        caption=_caption(summaries),
        caption_justify="left",
        box=box.SIMPLE_HEAD,
        padding=0,
    )
    table.add_column("estimator", no_wrap=True)
    for column in _COLUMNS:
        table.add_column(column.heading, justify="right", no_wrap=True, min_width=5)
    for name in dict.fromkeys(s["estimator"] for s in summaries):
        runs = [s for s in summaries if s["estimator"] == name]
        table.add_row(name, *(_cell(runs, column) for column in _COLUMNS))
    return table


def _caption(summaries: list[Summary]) -> str:
    runs: Callable[[str], int] = [s["estimator"] for s in summaries].count
    most = max((runs(s["estimator"]) for s in summaries), default=0)
    mean = f"Means over {most} runs. " if most > 1 else ""
    return (
        f"{mean}ATE aligned by SE(2), no scale; drift over segments of 5 to 40 m; NEES: 3 is "
        f"honest; ms a frame: update alone, without the first {WARM_UP_UPDATES}."
    )


def _cell(runs: list[Summary], column: _Column) -> str:
    values = [run[column.key] for run in runs if run[column.key] is not None]
    return _number(column.scale * float(np.mean(values)), column.digits) if values else "-"


def _number(value: float, digits: int) -> str:
    """As many digits as asked for, or fewer, to fit into five characters up to 99999."""
    before_point = len(f"{abs(value):.0f}")
    return f"{value:.{max(0, min(digits, 4 - before_point))}f}"
