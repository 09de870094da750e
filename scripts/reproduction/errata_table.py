"""The table of a paper's equations as printed and as corrected."""

from collections.abc import Sequence
from typing import NamedTuple

from grouser.scripts.reproduction.page import Number, Row, Table


class Erratum(NamedTuple):
    """A row of the table."""

    equation: str
    measured: str
    printed: str
    """The figure's name."""
    corrected: str | None
    """None where the printed form is right."""
    digits: int | None
    """After the point; None for numbers next to zero, which get a power of ten."""
    says: str


def errata_table(errata: Sequence[Erratum]) -> Table:
    """A row an erratum."""
    rows = []
    for erratum in errata:
        printed = _number(erratum, erratum.printed)
        corrected = "" if erratum.corrected is None else _number(erratum, erratum.corrected)
        rows.append(Row(erratum.equation, [erratum.measured, printed, corrected, erratum.says]))
    return Table(
        "Printed and corrected forms, computed when this page was made.",
        ["equation", "what was measured", "printed", "corrected", "remark"],
        rows,
        paper_columns=(2,),
    )


def _number(erratum: Erratum, key: str) -> Number:
    if erratum.digits is None:
        return Number(key, 0, scientific=True)
    return Number(key, erratum.digits)
