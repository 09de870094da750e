"""What the commands show on a terminal, and what in a file or a pipe."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)

PartT = TypeVar("PartT")

_PLAIN_WIDTH = 100


def table_console() -> Console:
    """For tables on stdout; written to a file or a pipe, they get the room that they need."""
    console = Console()
    return console if console.is_terminal else Console(width=_PLAIN_WIDTH)


@dataclass(frozen=True, slots=True)
class Bar:
    """A bar that is shown: what is being done, and how far it is."""

    _progress: Progress
    _task: TaskID

    def describe(self, words: str) -> None:
        """From here on this is being done."""
        self._progress.update(self._task, description=words)

    def advance(self, parts: int = 1) -> None:
        """So many more of the total are done."""
        self._progress.advance(self._task, parts)

    def over(self, parts: Iterable[PartT]) -> Iterator[PartT]:
        """These, each of which advances the bar."""
        for part in parts:
            yield part
            self.advance()


@contextmanager
def progress(words: str, total: int) -> Iterator[Bar]:
    """A bar of `total` parts on stderr, while the context lasts; none where that is no terminal."""
    console = Console(stderr=True)
    shown = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    )
    with shown:
        yield Bar(shown, shown.add_task(words, total=total))
