"""Figures of a page: their size, and one colour and dash a name throughout."""

from collections.abc import Sequence
from typing import Any

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8B5A2B", "#7F7F7F")
"""Okabe and Ito's colours, told apart by colour-blind readers too; a brown and a grey."""
_DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)))

Style = dict[str, Any]


def new_figure(width: float, height: float, rows: int = 1, columns: int = 1) -> tuple[Any, Any]:
    """A matplotlib figure of that size [inches], and its axes (rows, columns)."""
    # Imported here: it is an extra and slow. Without pyplot, there is no window and no state.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False)


def styles(names: Sequence[str]) -> dict[str, Style]:
    """A line's colour and dash for each name."""
    n = len(COLORS)
    return {
        name: {"color": COLORS[index % n], "linestyle": _DASHES[index // n % len(_DASHES)]}
        for index, name in enumerate(names)
    }


def finish(axes: Any, *, x: str, y: str, title: str = "", legend: bool = False) -> None:
    """Labels, a faint grid, and a legend where asked for."""
    axes.set(xlabel=x, ylabel=y)
    axes.set_title(title, fontsize="medium")
    axes.grid(alpha=0.3)
    if legend:
        axes.legend(loc="best", fontsize="small")
