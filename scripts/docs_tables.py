"""The tables of the documents in docs/, from the code that they describe.

`python -m grouser.scripts.docs_tables` writes them anew; a test fails where they are stale.
"""

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from grouser.envs.sensors.effects import effects_table
from grouser.envs.simulation.materials import MATERIALS
from grouser.envs.simulation.worlds.registry import world_descriptions
from grouser.scripts.estimator_docs import estimator_sections, option_group_sections


def materials_table() -> str:
    """What each ground is to a track."""
    lines = [
        "| `terrain` | friction | shear modulus, mm | motion resistance |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| `{m.name}` | {m.friction:g} | {1e3 * m.shear_modulus:g} | {m.resistance:g} |"
        for m in MATERIALS
    ]
    return "\n".join(lines)


def worlds_table() -> str:
    """Each kind of world in a line."""
    lines = ["| `world` | what it is |", "|---|---|"]
    lines += [f"| `{name}` | {words} |" for name, words in world_descriptions().items()]
    return "\n".join(lines)


DOCUMENTS: dict[Path, dict[str, Callable[[], str]]] = {
    Path("docs/simulation.md"): {
        "materials": materials_table,
        "worlds": worlds_table,
        "effects": effects_table,
    },
    Path("docs/estimators.md"): {
        "estimators": estimator_sections,
        "groups of options": option_group_sections,
    },
}
"""The tables of each document, by the names of the marks between which they stand."""


def with_tables(text: str, tables: Mapping[str, Callable[[], str]]) -> str:
    """The text with every table between its two marks, <!-- name --> and <!-- end of name -->."""
    for name, table in tables.items():
        marks = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end of {name} -->)", re.DOTALL)
        text, n = marks.subn(lambda found, t=table: f"{found[1]}{t()}\n{found[2]}", text)  # type: ignore[misc]
        if n != 1:
            raise ValueError(f"the text has {n} places for the table of {name}; it needs one")
    return text


def main() -> int:
    """Write the documents anew."""
    for document, tables in DOCUMENTS.items():
        document.write_text(with_tables(document.read_text(), tables))
    return 0


if __name__ == "__main__":
    sys.exit(main())
