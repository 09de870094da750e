"""What a page consists of. A number on it is only named here: its value is among the figures."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Number:
    """A figure, by its name."""

    key: str
    digits: int = 1
    """After the point."""
    signed: bool = False
    """Whether a plus is written, too."""
    scientific: bool = False
    """Whether it is written with a power of ten."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """A figure that is 1 where a claim holds and 0 where it does not."""

    key: str
    holds: str = "reached"
    fails: str = "missed"


Cell = str | Number | Verdict | tuple[str | Number, ...]
"""A string holds no measured number. A figure that does not exist is shown as a dash."""


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a table; its heading says what it is about."""

    heading: str
    cells: Sequence[Cell]
    stressed: bool = False
    from_paper: bool = False
    """Whether the paper printed its numbers."""


@dataclass(frozen=True, slots=True)
class Table:
    """A table; rows and columns with numbers of the paper are told apart by their colour."""

    caption: str
    columns: Sequence[str]
    """Headings, that of the rows' own headings first."""
    rows: Sequence[Row]
    paper_columns: Sequence[int] = ()
    """Which columns the paper printed."""


@dataclass(frozen=True, slots=True)
class Paragraph:
    """Prose, in which `{key:.1f}` stands for a figure; a brace of its own is doubled."""

    text: str


@dataclass(frozen=True, slots=True)
class Picture:
    """A matplotlib figure."""

    caption: str
    """Prose as in a paragraph."""
    figure: Any


Element = Table | Paragraph | Picture


@dataclass(frozen=True, slots=True)
class Section:
    """A part of a page under a heading."""

    title: str
    elements: Sequence[Element] = field(default_factory=tuple)


@dataclass(frozen=True, slots=True)
class Page:
    """A whole page."""

    title: str
    introduction: Sequence[Element]
    sections: Sequence[Section]
    footer: str


def plus_minus(mean: Number, deviation: Number) -> tuple[str | Number, ...]:
    """The cell of a mean and its standard deviation."""
    return (mean, "\N{NO-BREAK SPACE}\N{PLUS-MINUS SIGN}\N{NO-BREAK SPACE}", deviation)
