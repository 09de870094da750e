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
_ELLIPSES = 8
_CHI2_95_PLANE = 5.991


def require_matplotlib() -> None:
    """Say early that plots cannot be drawn.

    Raises:
        ImportError: matplotlib is not installed.
    """
    if find_spec("matplotlib") is None:
        raise ImportError(
            'plots need matplotlib: run pip install "grouser[plot]", or give --no-plots'
        )


def plot_results(folder: ResultsFolder) -> list[Path]:
    """Draw every seed's runs into PNG files of the folder and return their paths."""
    drawn = []
    runs = folder.trajectories()
    for seed in sorted({run.seed for run in runs}):
        of_seed = [run for run in runs if run.seed == seed]
        top_view = folder.path / f"top_view_seed{seed}.png"
        plot_top_view(of_seed, top_view)
        drawn.append(top_view)
        if all(run.truth is not None for run in of_seed):
            errors = folder.path / f"error_over_distance_seed{seed}.png"
            plot_errors(of_seed, errors)
            drawn.append(errors)
    return drawn


def plot_top_view(runs: list[RunTrajectories], path: Path) -> None:
    """The courses from above: the truth, and estimates with their 95 % ellipses."""
    figure, axes = _figure(1, (8, _height([run.estimate.poses for run in runs])))
    one_truth = _all_the_same([run.truth.poses for run in runs if run.truth is not None])
    for index, (run, color) in enumerate(zip(runs, _colors(runs), strict=True)):
        if run.truth is not None and (index == 0 or not one_truth):
            label = "truth" if one_truth else f"truth of {run.estimator}"
            xy = run.truth.poses[:, :2, 3]
            style = {"color": "black"} if one_truth else {"color": color, "linestyle": ":"}
            axes[0].plot(*xy.T, linewidth=2.5, alpha=0.6, label=label, **style)
        xy = run.estimate.poses[:, :2, 3]
        axes[0].plot(*xy.T, color=color, linewidth=1.2, label=run.estimator)
        _draw_ellipses(axes[0], run, color)
    axes[0].plot(0, 0, "k+", markersize=10, label="start")
    axes[0].set(xlabel="x [m]", ylabel="y [m]", title=f"Top view, seed {runs[0].seed}")
    axes[0].set_aspect("equal", adjustable="datalim")
    _save(figure, axes, path)


def plot_errors(runs: list[RunTrajectories], path: Path) -> None:
    """Error of position and of heading over the distance truly driven."""
    figure, axes = _figure(2, (8, 7))
    for run, color in zip(runs, _colors(runs), strict=True):
        assert run.truth is not None
        along = distances(run.truth.poses)
        error = project(run.estimate.poses) - project(run.truth.poses)
        away = np.linalg.norm(error[:, :2], axis=1)
        turned = np.degrees(wrap(error[:, 2]))
        axes[0].plot(along, away, color=color, label=run.estimator)
        axes[1].plot(along, turned, color=color, label=run.estimator)
    axes[0].set(ylabel="position error [m]", title=f"Error over distance, seed {runs[0].seed}")
    axes[1].set(xlabel="distance driven [m]", ylabel="heading error [deg]")
    _save(figure, axes, path)


def _figure(rows: int, size: tuple[float, float]) -> tuple[Any, list[Any]]:
    # Imported here: it is an extra and slow. Without pyplot, there is no window and no state.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, 1, sharex=True, squeeze=False)[:, 0])


def _height(courses: list[Array]) -> float:
    """Inches for a course that is 8 wide at one scale, within what is legible."""
    xy = np.concatenate([course[:, :2, 3] for course in courses])
    width, depth = np.ptp(xy, axis=0)
    return float(np.clip(8 * depth / max(width, 1e-9), 3.5, 8))


def _save(figure: Any, axes: list[Any], path: Path) -> None:
    for one in axes:
        one.grid(alpha=0.3)
    axes[0].legend(loc="best", fontsize="small")
    figure.savefig(path, dpi=120)


def _colors(runs: list[RunTrajectories]) -> list[str]:
    return [_COLORS[index % len(_COLORS)] for index in range(len(runs))]


def _all_the_same(truths: list[Array]) -> bool:
    return all(np.array_equal(truths[0], truth) for truth in truths)


def _draw_ellipses(axes: Any, run: RunTrajectories, color: str) -> None:
    """95 % ellipses of the position in a few frames, the last among them."""
    from matplotlib.patches import Ellipse

    if run.estimate.covariances is None:
        return
    frames = np.linspace(0, len(run.estimate.stamps) - 1, _ELLIPSES + 1).astype(int)[1:]
    for frame in frames:
        variances, directions = np.linalg.eigh(run.estimate.covariances[frame, :2, :2])
        height, width = 2 * np.sqrt(_CHI2_95_PLANE * np.maximum(variances, 0))
        angle = np.degrees(np.arctan2(directions[1, 1], directions[0, 1]))
        x, y = run.estimate.poses[frame, :2, 3]
        axes.add_patch(Ellipse((x, y), width, height, angle=angle, color=color, alpha=0.18, lw=0))
