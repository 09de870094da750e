"""Table 1 and fig. 6: milliseconds of each stage, and stereo matches, against the resolution."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grouser.agents.scripted import figure_eight
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.estimators import registry
from grouser.estimators.base import readable
from grouser.scripts.reproduction.drawing import finish, new_figure
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome, Outcomes
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Cell, Number, Paragraph, Picture, Row, Section, Table
from grouser.scripts.reproduction.zhao.contenders import forms, sensors_for
from grouser.scripts.reproduction.zhao.paper import RESOLUTIONS, size_name

STAGES = {
    "stereo_ms": ("ms_stereo", "ms_matching"),
    "estimation_ms": ("ms_ransac", "ms_refinement"),
    "filter_ms": ("ms_filter",),
}
"""The paper's three columns, and which of the estimator's diagnostics they are the sum of."""

WARM_UP = 5
"""Updates that do not count: kernels load and thresholds settle."""

_HEADINGS = {
    "stereo_ms": "stereo processing",
    "estimation_ms": "parameter estimation",
    "filter_ms": "Kalman filter",
}
_SEED = 0


@dataclass(frozen=True, slots=True)
class TimingExperiment(Experiment):
    """The same drive at one resolution, and how long an estimator takes for each frame of it."""

    size: tuple[int, int]
    """px"""
    names: tuple[str, ...]
    """Estimators that tell their stages' times."""
    frames: int

    @property
    def name(self) -> str:
        return f"timing-{size_name(self.size)}"

    @property
    def parts(self) -> int:
        return self.frames

    @property
    def measures_time(self) -> bool:
        return True

    def run(self, on_part: OnPart) -> Outcome:
        """`NAME.STAGE` (n,) ms of every stage and `NAME.update_ms`, and `NAME.features` (n,)."""
        env = TrackedRobotEnv(sensors=sensors_for(self.names), image_size=self.size)
        observation, _ = env.reset(seed=_SEED)
        estimators = {name: registry.make(name, env.rig) for name in self.names}
        for estimator in estimators.values():
            seen = readable(estimator, observation, {})
            estimator.reset(seen, rng=np.random.default_rng(_SEED))
        drive = figure_eight(env.rig)
        told: dict[str, list[dict[str, float]]] = {name: [] for name in self.names}
        for step in range(self.frames):
            observation = env.step(drive(step).astype(np.float32))[0]
            for name, estimator in estimators.items():
                estimate = estimator.update(readable(estimator, observation, {}))
                told[name].append(dict(estimate.diagnostics))
            on_part()
        env.close()
        return {
            f"{name}.{key}": np.array([frame.get(key, np.nan) for frame in told[name]])
            for name in self.names
            for key in _KEPT
        }


_KEPT = (*(part for parts in STAGES.values() for part in parts), "features")


def timing_experiments(names: Sequence[str], frames: int) -> list[Experiment]:
    """One a resolution of table 1."""
    return [TimingExperiment(size, forms(names), frames) for size in RESOLUTIONS]


def timing_figures(outcomes: Outcomes, names: Sequence[str]) -> Figures:
    """Means over the frames, as the paper has them."""
    figures: Figures = {}
    for size in RESOLUTIONS:
        outcome = outcomes[f"timing-{size_name(size)}"]
        for name in forms(names):
            values = {
                stage: sum(float(np.nanmean(outcome[f"{name}.{part}"][WARM_UP:])) for part in parts)
                for stage, parts in STAGES.items()
            }
            values["total_ms"] = sum(values.values())
            values["features"] = float(np.nanmean(outcome[f"{name}.features"][WARM_UP:]))
            figures |= named(f"timing.{size_name(size)}.{name}", values)
    return figures


def timing_section(figures: Figures, names: Sequence[str]) -> Section:
    """Table 1 and fig. 6."""
    return Section(
        "Processing time",
        [
            Paragraph(
                "A figure of eight in the gravel yard, once at each resolution; one processor core "
                "and one thread. Stereo processing includes matching over time, parameter "
                "estimation RANSAC and refinement. The paper does not say what its computer was: "
                "that ours is faster says little of either method, how the stages share the time "
                "says more."
            ),
            *(_table(name) for name in forms(names)),
            _matches(figures, names),
        ],
    )


def _table(name: str) -> Table:
    columns = ["resolution"]
    for heading in _HEADINGS.values():
        columns += [f"{heading}, the paper", "ours"]
    rows = []
    for size in RESOLUTIONS:
        cells: list[Cell] = []
        for stage in STAGES:
            cells.append(Number(f"paper.timing.{size_name(size)}.{stage}", 3))
            cells.append(Number(f"timing.{size_name(size)}.{name}.{stage}", 3))
        cells.append(Number(f"timing.{size_name(size)}.{name}.total_ms", 2))
        rows.append(Row(f"{size[0]} \N{MULTIPLICATION SIGN} {size[1]}", cells))
    return Table(
        f"Table 1: average milliseconds a frame, {name}.",
        [*columns, "ours in all"],
        rows,
        paper_columns=(1, 3, 5),
    )


def _matches(figures: Figures, names: Sequence[str]) -> Picture:
    figure, axes = new_figure(6.5, 3.2)
    labels = [size_name(size) for size in RESOLUTIONS]
    for name in forms(names):
        values = [figures[f"timing.{label}.{name}.features"] for label in labels]
        axes[0, 0].plot(labels, values, "o-", label=name)
    axes[0, 0].margins(y=0.15)
    axes[0, 0].set_ylim(bottom=0)
    finish(axes[0, 0], x="resolution [px]", y="stereo matches", legend=True)
    return Picture(
        "Fig. 6: average number of stereo matches. The corner detector's thresholds follow the "
        "image, so that there are about as many at any resolution.",
        figure,
    )
