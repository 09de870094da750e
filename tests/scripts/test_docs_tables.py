"""The tables of the documentation are those of the code."""

from pathlib import Path

import pytest

from grouser.scripts.docs_tables import DOCUMENT, with_tables


def test_no_table_is_stale(pytestconfig: pytest.Config) -> None:
    text = (Path(pytestconfig.rootpath) / DOCUMENT).read_text()
    assert with_tables(text) == text, "run python -m grouser.scripts.docs_tables"


def test_a_text_without_a_place_for_a_table_is_refused() -> None:
    with pytest.raises(ValueError, match="0 places for the table of materials; it needs one"):
        with_tables("# Nothing")
