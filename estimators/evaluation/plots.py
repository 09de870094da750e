"""Plots of a comparison: the courses from above, and the error over the distance driven."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from grouser.estimators.evaluation.metrics import distances
from grouser.estimators.evaluation.results import ResultsFolder, RunTrajectories
from grouser.geometry import Array, project, wrap

# Okabe and Ito's colours, told apart by colour-blind readers too.
_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442")
# Where courses coincide, the gaps of one show the other.
_DASHES = ("-", (0, (6, 2)), (0, (3, 2)), (0, (1, 1.5)))
_ELLIPSES = 4
# Errors are drawn to scale up to here and by their logarithm beyond: they differ by decades.
_LINEAR_M, _LINEAR_DEG = 1e-3, 0.1
_WIDTH = 8.0  # inches


def require_matplotlib(*, otherwise: str = ", or give --no-plots") -> None:
    """Say early that plots cannot be drawn, and what to do otherwise.

    Raises:
        ImportError: matplotlib is not installed.
    """
    if find_spec("matplotlib") is None:
        raise ImportError(f'plots need matplotlib: run pip install "grouser[plot]"{otherwise}')


def plot_results(folder: ResultsFolder) -> list[Path]:
    """Draw every seed's runs into PNG files of the folder and return their paths."""
    drawn = []
    runs = folder.trajectories()
    for seed in sorted({run.seed for run in runs}):
        of_seed = [run for run in runs if run.seed == seed]
        figures = {"top_view": top_view(of_seed)}
        if all(run.truth is not None for run in of_seed):
            figures["error_over_distance"] = error_over_distance(of_seed)
        for name, figure in figures.items():
            path = folder.path / f"{name}_seed{seed}.png"
            figure.savefig(path, dpi=120)
            drawn.append(path)
    return drawn


def top_view(runs: list[RunTrajectories]) -> Any:
    """The courses from above: the truth, and estimates with one-sigma ellipses."""
    truths = [run.truth.poses for run in runs if run.truth is not None]
    figure, (axes,) = _figure(1, _height([*truths, *(run.estimate.poses for run in runs)]))
    shared = all(np.array_equal(truths[0], truth) for truth in truths)
    for index, (run, style) in enumerate(zip(runs, _styles(runs), strict=True)):
        if run.truth is not None and (index == 0 or not shared):
            label = "truth" if shared else f"truth of {run.estimator}"
            color = "black" if shared else style["color"]
            axes.plot(*run.truth.poses[:, :2, 3].T, lw=4, alpha=0.3, color=color, label=label)
        axes.plot(*run.estimate.poses[:, :2, 3].T, lw=1.4, label=run.estimator, **style)
        for ellipse in _ellipses(run, style["color"]):
            # An artist, not a patch: what an estimator does not know must not set the scale.
            axes.add_artist(ellipse)
    axes.plot(0, 0, "k+", markersize=10, label="start")
    axes.set(xlabel="x [m]", ylabel="y [m]")
    axes.set_title(f"Top view, seed {runs[0].seed} (ellipses: one sigma)")
    axes.set_aspect("equal", adjustable="datalim")
    _finish([axes])
    return figure


def error_over_distance(runs: list[RunTrajectories]) -> Any:
    """Error of position and of heading over the distance truly driven."""
    figure, (position, heading) = _figure(2, 7.0)
    for run, style in zip(runs, _styles(runs), strict=True):
        assert run.truth is not None
        along = distances(run.truth.poses)
        error = project(run.estimate.poses) - project(run.truth.poses)
        away = np.linalg.norm(error[:, :2], axis=1)
        position.plot(along, away, label=run.estimator, **style)
        heading.plot(along, np.degrees(wrap(error[:, 2])), label=run.estimator, **style)
    position.set_yscale("symlog", linthresh=_LINEAR_M)
    heading.set_yscale("symlog", linthresh=_LINEAR_DEG)
    position.set(ylabel="position error [m]")
    position.set_title(
        f"Error over distance, seed {runs[0].seed} "
        f"(logarithmic beyond {_LINEAR_M:g} m and {_LINEAR_DEG:g} deg)"
    )
    heading.set(xlabel="distance driven [m]", ylabel="heading error [deg]")
    _finish([position, heading])
    return figure


def _figure(rows: int, height: float) -> tuple[Any, list[Any]]:
    # Imported here: it is an extra and slow. Without pyplot, there is no window and no state.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0])


def _height(courses: list[Array]) -> float:
    """Inches for courses that fill the width at one scale, within what is legible."""
    xy = np.concatenate([course[:, :2, 3] for course in courses])
    width, depth = np.ptp(xy, axis=0)
    return float(np.clip(_WIDTH * depth / max(width, 1e-9), 3.5, _WIDTH))


def _finish(axes: list[Any]) -> None:
    for one in axes:
        one.grid(alpha=0.3)
    axes[0].legend(loc="best", fontsize="small")


def _styles(runs: list[RunTrajectories]) -> list[dict[str, Any]]:
    return [
        {"color": _COLORS[index % len(_COLORS)], "linestyle": _DASHES[index % len(_DASHES)]}
        for index in range(len(runs))
    ]


def _ellipses(run: RunTrajectories, color: str) -> list[Any]:
    """One-sigma ellipses of the position in a few frames, the last among them."""
    from matplotlib.patches import Ellipse

    if run.estimate.covariances is None:
        return []
    ellipses = []
    frames = np.linspace(0, len(run.estimate.stamps) - 1, _ELLIPSES + 1).astype(int)[1:]
    for frame in frames:
        variances, directions = np.linalg.eigh(run.estimate.covariances[frame, :2, :2])
        height, width = 2 * np.sqrt(np.maximum(variances, 0))
        angle = np.degrees(np.arctan2(directions[1, 1], directions[0, 1]))
        x, y = run.estimate.poses[frame, :2, 3]
        ellipse = Ellipse((x, y), width, height, angle=angle, fc="none", ec=color, lw=0.8, ls=":")
        ellipses.append(ellipse)
    return ellipses
