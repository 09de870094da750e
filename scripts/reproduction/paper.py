"""What a paper is to the command: experiments, the figures that follow, and the page."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from grouser.scripts.reproduction.experiment import Experiment, Outcomes
from grouser.scripts.reproduction.figures import Figures
from grouser.scripts.reproduction.page import Page


class Paper(ABC):
    """A paper's experiments at some scale: a frozen value."""

    @property
    @abstractmethod
    def settings(self) -> Mapping[str, Any]:
        """What its experiments depend on besides the scale, for the folder to remember."""

    @abstractmethod
    def experiments(self) -> list[Experiment]:
        """All of them."""

    @abstractmethod
    def figures(self, outcomes: Outcomes) -> Figures:
        """Every number that the page may show, the paper's own among them."""

    @abstractmethod
    def page(self, outcomes: Outcomes, figures: Figures) -> Page:
        """The page."""
