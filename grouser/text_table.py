"""Text files of numbers, one row a line; what is wrong with one is said with file and line."""

from pathlib import Path

import numpy as np

from grouser.geometry import Array


def read_text(path: str | Path) -> str:
    """The text of a file.

    Raises:
        FileNotFoundError: there is none.
        ValueError: it is not text.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path} is missing or is not a file")
    try:
        return path.read_text()
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is not a text file: {error}") from error


def parse_row(words: list[str], columns: tuple[int, ...], place: str) -> list[float]:
    """The numbers of one row, found at `place` ("file:line").

    Raises:
        ValueError: not as many finite numbers as one of `columns`.
    """
    expected = " or ".join(str(count) for count in columns)
    if len(words) not in columns:
        raise ValueError(f"{place}: expected {expected} numbers, found {len(words)} entries")
    try:
        row = [float(word) for word in words]
    except ValueError as error:
        raise ValueError(f"{place}: expected {expected} numbers, but {error}") from error
    if not np.all(np.isfinite(row)):
        raise ValueError(f"{place}: expected {expected} finite numbers, found {' '.join(words)}")
    return row


def read_rows(path: str | Path, *columns: int) -> tuple[Array, list[int]]:
    """Numbers (N, C), C being one of `columns`, and the line number of each row.

    Empty lines and lines that begin with # are passed over.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: a malformed row, named by file and line, or no row at all.
    """
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        allowed = (len(rows[0]),) if rows else columns
        rows.append(parse_row(words, allowed, f"{path}:{number}"))
        lines.append(number)
    if not rows:
        raise ValueError(f"{path}:1: the file holds no row of numbers")
    return np.array(rows), lines
