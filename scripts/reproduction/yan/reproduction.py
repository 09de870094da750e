"""The whole of it: which experiments there are, what their figures are, and how the page goes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from grouser import __version__
from grouser.scripts.reproduction.experiment import Experiment, Outcomes
from grouser.scripts.reproduction.figures import Figures
from grouser.scripts.reproduction.page import Element, Page, Paragraph
from grouser.scripts.reproduction.paper import Paper
from grouser.scripts.reproduction.yan.contests import (
    contest_experiments,
    contest_figures,
    contest_section,
)
from grouser.scripts.reproduction.yan.errata import NAME as ERRATA
from grouser.scripts.reproduction.yan.errata import (
    ErrataExperiment,
    errata_figures,
    errata_section,
)
from grouser.scripts.reproduction.yan.heading_sweep import (
    sweep_experiments,
    sweep_figures,
    sweep_section,
)
from grouser.scripts.reproduction.yan.monte_carlo import MonteCarlo, joined
from grouser.scripts.reproduction.yan.observer_cases import NAME as CASES
from grouser.scripts.reproduction.yan.observer_cases import ObserverCases, observer_figures
from grouser.scripts.reproduction.yan.observer_times import ObserverTimes
from grouser.scripts.reproduction.yan.over_range import NAME as VISIBLE
from grouser.scripts.reproduction.yan.over_range import (
    FarthestVisible,
    over_range_figures,
    over_range_section,
)
from grouser.scripts.reproduction.yan.paper import paper_figures
from grouser.scripts.reproduction.yan.scale import QUICK, Scale
from grouser.scripts.reproduction.yan.summary import summary_figures, summary_table
from grouser.scripts.reproduction.yan.table_1 import table_1_figures, table_1_section
from grouser.scripts.reproduction.yan.trajectories import (
    trajectory_experiments,
    trajectory_figures,
    trajectory_section,
)


@dataclass(frozen=True, slots=True)
class Yan(Paper):
    """Paper 2's section 3 at this scale, and what it lacks."""

    scale: Scale

    @property
    def settings(self) -> Mapping[str, Any]:
        """There are none."""
        return {}

    def experiments(self) -> list[Experiment]:
        """All of them, those that measure time first."""
        scale = self.scale
        return [
            ObserverTimes(scale.rounds, scale.timed_steps),
            ObserverTimes(scale.interpreted_rounds, scale.timed_steps, interpreted=True),
            *trajectory_experiments(),
            *self._drives(),
            FarthestVisible(),
            ObserverCases(scale.cases),
            ErrataExperiment(scale.jacobian_points),
        ]

    def figures(self, outcomes: Outcomes) -> Figures:
        """Every number that the page may show, the paper's own among them."""
        drives = joined(outcomes, self._drives())
        figures = (
            paper_figures()
            | trajectory_figures(outcomes)
            | contest_figures(drives)
            | sweep_figures(drives, self.scale)
            | over_range_figures(outcomes[VISIBLE], drives)
            | table_1_figures(outcomes, self.scale)
            | observer_figures(outcomes[CASES])
            | errata_figures(outcomes[ERRATA])
        )
        return figures | summary_figures(figures)

    def page(self, outcomes: Outcomes, figures: Figures) -> Page:
        """The page."""
        return Page(
            "EKF SLAM with lines seen by bisection, reproduced",
            self._introduction(),
            [
                trajectory_section(outcomes),
                table_1_section(),
                over_range_section(),
                contest_section(figures),
                sweep_section(joined(outcomes, self._drives()), self.scale),
                errata_section(),
            ],
            f"Made by `grouser reproduce yan`, Grouser {__version__}. Every number here is in "
            "results.json, under the name that shows when the pointer rests on it.",
        )

    def _drives(self) -> list[MonteCarlo]:
        return [*contest_experiments(self.scale), *sweep_experiments(self.scale)]

    def _introduction(self) -> list[Element]:
        """What this is, and the summary."""
        elements: list[Element] = [Paragraph(_INTRODUCTION)]
        if self.scale == QUICK:
            elements.append(Paragraph(_QUICK))
        return [*elements, summary_table()]


_QUICK = (
    "This page was made with --quick, to see that everything works: a few drives, so that averages "
    "and their bounds mean little."
)

_INTRODUCTION = (
    'X. Yan, G. Yang and L. Wang, "EKF-SLAM algorithm based on dichotomy", Navigation Positioning '
    "and Timing 7(3), 2020. Its section 3 again: the same four lines, way-points and noises; what "
    "it leaves out (wheelbase, how often the sensor looks, when a way-point is reached) is as in "
    "the simulator of Bailey and Nieto, whose numbers it uses. Then what it lacks: many drives "
    "instead of one, and whether the filter knows how wrong it is."
)
