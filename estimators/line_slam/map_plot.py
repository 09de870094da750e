"""A picture of a map: its lines, each with the band that it lies in, over what is truly there."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from grouser.estimators.line_slam.lines import normals, points_on
from grouser.estimators.line_slam.map import LineMap
from grouser.geometry import Array

_WIDTH = 10.0  # inches
_BAND_POINTS = 33
_LINE, _BAND, _WAY, _TRUTH, _TRUE_WAY = "#D55E00", "#E69F00", "#0072B2", "#555555", "#222222"


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a map is drawn over, all in the frame of the start; what is not known is empty."""

    way: Array
    """(N, 3) the estimated poses."""
    true_way: Array = field(default_factory=lambda: np.zeros((0, 3)))
    """(N, 3) the true poses, or those of a reference."""
    segments: Array = field(default_factory=lambda: np.zeros((0, 4)))
    """(m, 4) both ends of what truly stands there, m."""
    points: Array = field(default_factory=lambda: np.zeros((0, 2)))
    """(k, 2) what a lidar hit, m."""
    points_from: str = "scans from the true poses"
    """Which poses put them there."""


def draw_map(line_map: LineMap, over: Surroundings, *, sigmas: float = 3.0, title: str = "") -> Any:
    """A matplotlib figure from above; needs the extra `plot`.

    Args:
        sigmas: half width of the bands. An end that is known has a dot, an open one has none.
    """
    figure, axes = _figure(line_map, over)
    axes.plot(*over.points.T, ".", ms=1.0, color=_TRUTH, alpha=0.25, zorder=1)
    _segments(axes, over.segments.reshape(-1, 2, 2), color=_TRUTH, lw=5, alpha=0.35, zorder=1)
    axes.plot(*over.true_way[:, :2].T, lw=3.5, color=_TRUE_WAY, alpha=0.3, zorder=2)
    axes.plot(*over.way[:, :2].T, lw=1.2, color=_WAY, zorder=3)
    axes.plot(0, 0, "k+", ms=10, zorder=6)
    if len(line_map):
        _bands(axes, bands(line_map, sigmas=sigmas))
        _segments(axes, line_map.ends, color=_LINE, lw=1.2, zorder=5)
        axes.plot(*line_map.ends[~line_map.open_ends].T, ".", ms=6, color=_LINE, zorder=5)
    _legend(axes, line_map, over, sigmas)
    axes.set(xlabel="x [m]", ylabel="y [m]", title=title)
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(alpha=0.3)
    return figure


def bands(line_map: LineMap, *, sigmas: float) -> Array:
    """(n, 2 k, 2) the outline of the band about each line between its ends, m."""
    t = np.linspace(line_map.extents[:, 0], line_map.extents[:, 1], _BAND_POINTS, axis=1)
    middle = points_on(line_map.lines[:, None], t)
    across = sigmas * line_map.offset_sigmas(t)[..., None] * normals(line_map.lines[:, 1])[:, None]
    return np.concatenate([middle + across, (middle - across)[:, ::-1]], axis=1)


def _bands(axes: Any, outlines: Array) -> None:
    from matplotlib.collections import PolyCollection

    axes.add_collection(PolyCollection(list(outlines), facecolors=_BAND, alpha=0.45, zorder=4))


def _segments(axes: Any, ends: Array, **style: Any) -> None:
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(ends), **style))


def _figure(line_map: LineMap, over: Surroundings) -> tuple[Any, Any]:
    # Imported here: it is an extra and slow. Without pyplot, there is no window and no state.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    drawn = [line_map.ends.reshape(-1, 2), over.segments.reshape(-1, 2), over.way[:, :2]]
    shown = np.concatenate([*drawn, over.true_way[:, :2], over.points, np.zeros((1, 2))])
    low, high = shown.min(axis=0), shown.max(axis=0)
    wide, deep = np.maximum(high - low, 1.0)
    height = float(np.clip(_WIDTH * deep / wide, 4.0, _WIDTH)) + 1.0
    figure = Figure(figsize=(_WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.update_datalim(np.array([low, high]))
    return figure, axes


def _legend(axes: Any, line_map: LineMap, over: Surroundings, sigmas: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    widest = float(line_map.offset_sigmas(line_map.extents).max(initial=0.0))
    handles: list[Any] = [
        Line2D([], [], color=_LINE, lw=1.2, label=f"{len(line_map)} lines (dot: a known end)"),
        Patch(color=_BAND, alpha=0.45, label=f"{sigmas:g} sigma (one is at most {widest:.2g} m)"),
        Line2D([], [], color=_WAY, lw=1.2, label="estimated way"),
    ]
    if len(over.true_way):
        handles.append(Line2D([], [], color=_TRUE_WAY, lw=3.5, alpha=0.3, label="true way"))
    if len(over.segments):
        handles.append(Line2D([], [], color=_TRUTH, lw=5, alpha=0.35, label="what stands there"))
    if len(over.points):
        handles.append(Line2D([], [], color=_TRUTH, ls="", marker=".", label=over.points_from))
    axes.legend(handles=handles, loc="best", fontsize="small")
