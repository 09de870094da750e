"""The whole of it: which experiments there are, what their figures are, and how the page goes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from grouser import __version__
from grouser.scripts.reproduction.experiment import Experiment, Outcomes
from grouser.scripts.reproduction.figures import Figures
from grouser.scripts.reproduction.page import Element, Page, Paragraph, Section
from grouser.scripts.reproduction.paper import Paper
from grouser.scripts.reproduction.zhao.contenders import RECOMMENDED
from grouser.scripts.reproduction.zhao.course_experiment import CourseExperiment, subjects
from grouser.scripts.reproduction.zhao.courses import (
    free_indoors,
    free_outdoors,
    linear_indoors,
    linear_outdoors,
    spot_turns,
)
from grouser.scripts.reproduction.zhao.errata import NAME as ERRATA
from grouser.scripts.reproduction.zhao.errata import (
    ErrataExperiment,
    errata_figures,
    errata_section,
)
from grouser.scripts.reproduction.zhao.free_motion import free_figures, free_section
from grouser.scripts.reproduction.zhao.linear_motion import linear_figures, linear_section
from grouser.scripts.reproduction.zhao.offset_study import (
    offset_experiments,
    offset_figures,
    offset_section,
)
from grouser.scripts.reproduction.zhao.paper import paper_figures
from grouser.scripts.reproduction.zhao.pipeline_diagram import pipeline_section
from grouser.scripts.reproduction.zhao.processing_time import (
    timing_experiments,
    timing_figures,
    timing_section,
)
from grouser.scripts.reproduction.zhao.scale import QUICK, Scale
from grouser.scripts.reproduction.zhao.slip_drives import (
    slip_elements,
    slip_experiments,
    slip_figures,
)
from grouser.scripts.reproduction.zhao.solver_curves import solver_elements, solver_figures
from grouser.scripts.reproduction.zhao.solver_trials import OutlierTrials, SlipTrials
from grouser.scripts.reproduction.zhao.spot_turns import spot_turn_figures, spot_turn_section
from grouser.scripts.reproduction.zhao.stability import (
    NAME as STABILITY,
)
from grouser.scripts.reproduction.zhao.stability import (
    StabilityExperiment,
    stability_figures,
    stability_section,
)
from grouser.scripts.reproduction.zhao.stereo_pictures import (
    NAME as PICTURES,
)
from grouser.scripts.reproduction.zhao.stereo_pictures import (
    PicturesExperiment,
    picture_figures,
    pictures_section,
)
from grouser.scripts.reproduction.zhao.summary import summary_figures, summary_table

_COURSES = (linear_indoors, linear_outdoors, spot_turns, free_indoors, free_outdoors)


@dataclass(frozen=True, slots=True)
class Zhao(Paper):
    """Paper 1's section IV with these estimators at this scale."""

    names: tuple[str, ...]
    scale: Scale

    @property
    def settings(self) -> Mapping[str, Any]:
        """Which estimators take part."""
        return {"estimators": self.names}

    def experiments(self) -> list[Experiment]:
        """All of them, those that measure time among them first."""
        names, scale = self.names, self.scale
        courses = [course for kind in _COURSES for course in kind(scale)]
        return [
            StabilityExperiment(RECOMMENDED, scale.stability_frames),
            *timing_experiments(names, scale.timing_frames),
            OutlierTrials(scale.trials),
            SlipTrials(scale.trials),
            *(CourseExperiment(course, subjects(names)) for course in courses),
            *offset_experiments(names, scale),
            *slip_experiments(names, scale),
            ErrataExperiment(scale.errata_runs),
            PicturesExperiment(),
        ]

    def figures(self, outcomes: Outcomes) -> Figures:
        """Every number that the page may show, the paper's own among them."""
        names, scale = self.names, self.scale
        figures = (
            paper_figures()
            | stability_figures(outcomes[STABILITY])
            | timing_figures(outcomes, names)
            | linear_figures(outcomes, names, scale)
            | spot_turn_figures(outcomes, names, scale)
            | free_figures(outcomes, names, scale)
            | offset_figures(outcomes, names)
            | solver_figures(outcomes)
            | slip_figures(outcomes, names)
            | errata_figures(outcomes[ERRATA])
            | picture_figures(outcomes[PICTURES])
        )
        return figures | summary_figures(figures)

    def page(self, outcomes: Outcomes, figures: Figures) -> Page:
        """The page."""
        names, scale = self.names, self.scale
        return Page(
            "One-point RANSAC for a crawler robot, reproduced",
            self._introduction(),
            [
                timing_section(figures, names),
                stability_section(outcomes[STABILITY]),
                linear_section(outcomes, names, scale),
                spot_turn_section(outcomes, names, scale),
                free_section(outcomes, names, scale),
                offset_section(names),
                Section(
                    "Where one point loses",
                    [*solver_elements(outcomes), *slip_elements(figures, names)],
                ),
                pipeline_section(),
                pictures_section(outcomes[PICTURES]),
                errata_section(),
            ],
            f"Made by `grouser reproduce zhao`, Grouser {__version__}. Every number here is in "
            "results.json, under the name that shows when the pointer rests on it.",
        )

    def _introduction(self) -> list[Element]:
        """What this is, and the summary."""
        elements: list[Element] = [Paragraph(_INTRODUCTION)]
        if self.scale == QUICK:
            elements.append(Paragraph(_QUICK))
        return [*elements, summary_table(self.names)]


_QUICK = (
    "This page was made with --quick, to see that everything works: a few frames of each set, so "
    "that most numbers mean little."
)

_INTRODUCTION = (
    'X. Zhao, J. Kan and C. Zhan, "1-Point RANSAC application: an independent positioning method '
    'for crawler mobile robots based on binocular stereo vision". Its section IV again: the same '
    "sets of experiments with as many frames, in simulated worlds, with images of 320 "
    "\N{MULTIPLICATION SIGN} 240 pixels where nothing else is said. The paper drove a real robot; "
    "its camera had a lens, its ground had stones. So a smaller number of ours is no proof that "
    "the method became better: compare within the tables, where all estimators saw the same bits."
)
