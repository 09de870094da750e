"""What an experiment is: a piece of work with a name, whose outcome is kept on disk."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any

from numpy.typing import NDArray

Outcome = Mapping[str, NDArray[Any]]
"""What was measured, raw, by name: the page's figures are computed from it anew every time."""

Outcomes = Mapping[str, Outcome]
"""Those of all experiments, by the experiments' names."""

OnPart = Callable[[], None]
"""Called after every part of the work, for a progress bar."""


class Experiment(ABC):
    """A piece of work that a process does from nothing but itself: a frozen, picklable value."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Its name, and that of its file: letters, digits, dots and hyphens."""

    @property
    def parts(self) -> int:
        """How often `run` says that a part is done."""
        return 1

    @property
    def measures_time(self) -> bool:
        """Whether it must have the machine to itself."""
        return False

    @abstractmethod
    def run(self, on_part: OnPart) -> Outcome:
        """Do it. The same experiment gives the same outcome, but for times."""
