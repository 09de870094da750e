"""The tables of the documentation are those of the code."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from grouser.estimators import names
from grouser.scripts.docs_tables import DOCUMENTS, materials_table, with_tables
from grouser.scripts.estimator_docs import (
    estimator_sections,
    field_texts,
    option_group_sections,
    option_texts,
)


@pytest.mark.parametrize("document", DOCUMENTS, ids=str)
def test_no_table_is_stale(pytestconfig: pytest.Config, document: Path) -> None:
    text = (Path(pytestconfig.rootpath) / document).read_text()
    stale = with_tables(text, DOCUMENTS[document]) != text
    assert not stale, "run python -m grouser.scripts.docs_tables"


def test_a_text_without_a_place_for_a_table_is_refused() -> None:
    with pytest.raises(ValueError, match="0 places for the table of materials; it needs one"):
        with_tables("# Nothing", {"materials": materials_table})


def test_every_estimator_is_described() -> None:
    told = estimator_sections()
    assert [name for name in names() if f"`{name}`" not in told] == []


def test_options_are_read_from_a_docstring() -> None:
    docstring = """Do it.

Args:
    slow: takes its time,
        and more | of it.
    fast: does not.

Raises:
    ValueError: never: really.
"""
    assert option_texts(docstring) == {
        "slow": "takes its time, and more \\| of it.",
        "fast": "does not.",
    }
    assert option_texts("Nothing here.") == {}


@dataclass(frozen=True)
class Tea:
    """A drink."""

    minutes: float = 4.0
    """How long
    it draws."""
    sugar: bool = False
    leaves: int = 7
    """How many."""


def test_fields_are_read_with_what_stands_below_them() -> None:
    assert field_texts(Tea) == {"minutes": "How long it draws.", "leaves": "How many."}


def test_tables_hold_no_address_in_memory() -> None:
    """They would differ from process to process; a value such as a map is no group of options."""
    assert " at 0x" not in estimator_sections() + option_group_sections()
