"""Makes the picture of the README: the robot, what it sees, and where estimators think it went.

python -m grouser.scripts.readme_picture --output docs/picture.png
"""

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import tyro
from numpy.typing import NDArray

from grouser.estimators import make
from grouser.estimators.evaluation.comparison import Run, compare_open_loop
from grouser.geometry import Array

ESTIMATORS = {"dead-reckoning": "tab:orange", "one-point-ransac": "tab:blue"}
STEPS = 500
INCHES, DOTS_PER_INCH = (10.0, 4.6), 100


def main(output: Path = Path("docs/picture.png"), seed: int = 0) -> None:
    """Drive a spiral and draw it.

    Args:
        output: the PNG file to write.
        seed: of the world and the noise.
    """
    env = gym.make(
        "grouser/TrackedRobot-v0",
        world="yard",
        sensors=("left", "right", "tracks"),
        render_mode="rgb_array",
    )
    rig = env.get_wrapper_attr("rig")
    estimators = {name: make(name, rig) for name in ESTIMATORS}
    runs = compare_open_loop(env, estimators, spiral, seed=seed, steps=STEPS)
    behind: Any = env.render()
    seen = env.step(np.zeros(2, dtype=np.float32))[0]["left"][..., 0]
    env.close()
    output.parent.mkdir(parents=True, exist_ok=True)
    draw(runs, behind, seen).savefig(output, dpi=DOTS_PER_INCH)
    print(output)


def spiral(step: int) -> Array:
    """The action (2,) of a curve to the left that tightens."""
    return np.array([0.75 - 0.4 * step / STEPS, 0.95])


def draw(runs: list[Run], behind: NDArray[np.uint8], seen: NDArray[np.uint8]) -> Any:
    """The figure: two views on the left, the courses from above on the right."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=INCHES, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, width_ratios=[1.0, 1.75])
    for row, (image, title) in enumerate(
        [(behind, "the robot in the yard"), (seen, "its left camera")]
    ):
        view = figure.add_subplot(grid[row, 0])
        view.imshow(image, cmap="gray", vmin=0, vmax=255)
        view.set_title(title, fontsize="medium")
        view.set_axis_off()
    _draw_courses(figure.add_subplot(grid[:, 1]), runs)
    return figure


def _draw_courses(axes: Any, runs: list[Run]) -> None:
    truth = runs[0].true_poses
    assert truth is not None
    axes.plot(truth[:, 0], truth[:, 1], color="black", linewidth=3, alpha=0.35, label="truth")
    for run in runs:
        course = np.array([estimate.pose for estimate in run.estimates])
        axes.plot(course[:, 0], course[:, 1], color=ESTIMATORS[run.estimator], label=run.estimator)
        axes.plot(*course[-1, :2], "o", color=ESTIMATORS[run.estimator])
        axes.add_patch(_ellipse(run))
    axes.plot(*truth[-1, :2], "o", color="black", alpha=0.6)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("where it went, and one sigma of where it thinks it is", fontsize="medium")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    axes.grid(alpha=0.3)
    axes.legend(loc="upper left", fontsize="small")


def _ellipse(run: Run) -> Any:
    """One sigma of the last position."""
    from matplotlib.patches import Ellipse

    last = run.estimates[-1]
    variances, axes = np.linalg.eigh(last.covariance[:2, :2])
    width, height = 2 * np.sqrt(variances)
    angle_degrees = float(np.degrees(np.arctan2(axes[1, 0], axes[0, 0])))
    color = ESTIMATORS[run.estimator]
    return Ellipse(tuple(last.pose[:2]), width, height, angle=angle_degrees, color=color, alpha=0.2)


if __name__ == "__main__":
    tyro.cli(main)
