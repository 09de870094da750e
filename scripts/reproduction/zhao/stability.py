"""The long run: 10 000 frames, how long they take and whether memory grows."""

import time
from dataclasses import dataclass

import numpy as np

from grouser.estimators import registry
from grouser.estimators.base import readable
from grouser.scripts.memory import peak_megabytes
from grouser.scripts.reproduction.drawing import finish, new_figure
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Number, Paragraph, Picture, Row, Section, Table
from grouser.scripts.reproduction.zhao.contenders import RECOMMENDED, sensors_for
from grouser.scripts.reproduction.zhao.course import Course, plan
from grouser.scripts.reproduction.zhao.manoeuvres import Tour

NAME = "stability"

_WARM_UP = 0.1  # of the frames: kernels load and lists get as long as they will


@dataclass(frozen=True, slots=True)
class StabilityExperiment(Experiment):
    """One estimator on one long drive."""

    estimator: str
    frames: int

    @property
    def name(self) -> str:
        return NAME

    @property
    def parts(self) -> int:
        return self.frames

    @property
    def measures_time(self) -> bool:
        return True

    def run(self, on_part: OnPart) -> Outcome:
        """`ms` (n,) of every update, and `megabytes` (n,) the process's peak after it."""
        course = Course(name=NAME, world="garden", manoeuvre=Tour(), frames=self.frames)
        planned = plan(course)
        env = course.make(sensors_for([self.estimator]))
        estimator = registry.make(self.estimator, env.rig)
        observation, _ = env.reset(seed=planned.seed)
        seen = readable(estimator, observation, {})
        estimator.reset(seen, rng=np.random.default_rng(planned.seed))
        ms, megabytes = np.empty(self.frames), np.empty(self.frames)
        for step, action in enumerate(planned.actions.astype(np.float32)):
            seen = readable(estimator, env.step(action)[0], {})
            began = time.perf_counter()
            estimator.update(seen)
            ms[step] = 1e3 * (time.perf_counter() - began)
            megabytes[step] = peak_megabytes()
            on_part()
        env.close()
        return {"ms": ms, "megabytes": megabytes}


def stability_figures(outcome: Outcome) -> Figures:
    """Mean and standard deviation of the time, and by how much memory grew after the warm-up."""
    ms, megabytes = outcome["ms"], outcome["megabytes"]
    first = int(len(ms) * _WARM_UP)
    values = {
        "frames": len(ms),
        "mean_ms": float(ms[first:].mean()),
        "deviation_ms": float(ms[first:].std()),
        "slowest_ms": float(ms[first:].max()),
        "frames_per_second": 1e3 / float(ms[first:].mean()),
        "growth_mb": float(megabytes[-1] - megabytes[first]),
    }
    return named("stability", values)


def stability_section(outcome: Outcome) -> Section:
    """A table, and time and memory over the frames."""
    rows = [
        Row(
            "the paper",
            [Number("paper.stability.mean_ms", 2), Number("paper.stability.deviation_ms", 2)]
            + ["", "", ""],
            from_paper=True,
        ),
        Row(
            RECOMMENDED,
            [
                Number("stability.mean_ms", 2),
                Number("stability.deviation_ms", 2),
                Number("stability.slowest_ms", 1),
                Number("stability.frames_per_second", 0),
                Number("stability.growth_mb", 1),
            ],
            stressed=True,
        ),
    ]
    columns = ["", "mean, ms", "standard deviation, ms", "slowest, ms", "frames a second"]
    return Section(
        "Stability",
        [
            Paragraph(
                "One drive of {stability.frames:.0f} frames through the garden at 320 "
                "\N{MULTIPLICATION SIGN} 240, on one core. Memory is the peak of the process's "
                "resident set, the simulator's included; the first tenth is warm-up."
            ),
            Table("The long run.", [*columns, "growth of memory, MB"], rows),
            _picture(outcome),
        ],
    )


def _picture(outcome: Outcome) -> Picture:
    figure, axes = new_figure(11, 2.8, 1, 2)
    ms, megabytes = outcome["ms"], outcome["megabytes"]
    frames = np.arange(len(ms))
    axes[0, 0].plot(frames, ms, ".", ms=1.5, alpha=0.5)
    axes[0, 0].set_ylim(0, 3 * float(np.median(ms)))
    axes[0, 1].plot(frames, megabytes)
    axes[0, 1].set_ylim(0, 1.3 * float(megabytes[-1]))
    finish(axes[0, 0], x="frame", y="time of the update [ms]")
    finish(axes[0, 1], x="frame", y="peak of the memory [MB]")
    return Picture("Time of every frame, and memory over the frames.", figure)
