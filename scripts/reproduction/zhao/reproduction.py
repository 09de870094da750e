"""The whole of it: which experiments there are, what their figures are, and how the page goes."""

from dataclasses import dataclass

from grouser import __version__
from grouser.scripts.reproduction.experiment import Experiment, Outcomes
from grouser.scripts.reproduction.figures import Figures
from grouser.scripts.reproduction.page import Page
from grouser.scripts.reproduction.zhao.course_experiment import CourseExperiment, subjects
from grouser.scripts.reproduction.zhao.courses import (
    free_indoors,
    free_outdoors,
    linear_indoors,
    linear_outdoors,
    spot_turns,
)
from grouser.scripts.reproduction.zhao.free_motion import free_figures, free_section
from grouser.scripts.reproduction.zhao.linear_motion import linear_figures, linear_section
from grouser.scripts.reproduction.zhao.paper import paper_figures
from grouser.scripts.reproduction.zhao.processing_time import (
    timing_experiments,
    timing_figures,
    timing_section,
)
from grouser.scripts.reproduction.zhao.scale import Scale
from grouser.scripts.reproduction.zhao.spot_turns import spot_turn_figures, spot_turn_section
from grouser.scripts.reproduction.zhao.stability import (
    NAME as STABILITY,
)
from grouser.scripts.reproduction.zhao.stability import (
    stability_experiments,
    stability_figures,
    stability_section,
)

_COURSES = (linear_indoors, linear_outdoors, spot_turns, free_indoors, free_outdoors)


@dataclass(frozen=True, slots=True)
class Zhao:
    """Paper 1's section IV with these estimators at this scale."""

    names: tuple[str, ...]
    scale: Scale

    def experiments(self) -> list[Experiment]:
        """All of them, those that measure time among them first."""
        names, scale = self.names, self.scale
        courses = [course for kind in _COURSES for course in kind(scale)]
        return [
            *stability_experiments(names, scale.stability_frames),
            *timing_experiments(names, scale.timing_frames),
            *(CourseExperiment(course, subjects(names)) for course in courses),
        ]

    def figures(self, outcomes: Outcomes) -> Figures:
        """Every number that the page may show, the paper's own among them."""
        names, scale = self.names, self.scale
        return (
            paper_figures()
            | stability_figures(outcomes[STABILITY])
            | timing_figures(outcomes, names)
            | linear_figures(outcomes, names, scale)
            | spot_turn_figures(outcomes, names, scale)
            | free_figures(outcomes, names, scale)
        )

    def page(self, outcomes: Outcomes, figures: Figures) -> Page:
        """The page."""
        names, scale = self.names, self.scale
        return Page(
            "One-point RANSAC for a crawler robot, reproduced",
            [],
            [
                timing_section(figures, names),
                stability_section(outcomes[STABILITY]),
                linear_section(outcomes, names, scale),
                spot_turn_section(outcomes, names, scale),
                free_section(outcomes, names, scale),
            ],
            f"Made by `grouser reproduce zhao`, Grouser {__version__}.",
        )
