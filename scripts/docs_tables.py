"""The tables of docs/simulation.md, from the code that they describe.

`python -m grouser.scripts.docs_tables` writes them anew; a test fails where they are stale.
"""

import re
import sys
from collections.abc import Callable
from pathlib import Path

from grouser.envs.sensors.effects import effects_table
from grouser.envs.simulation.materials import MATERIALS
from grouser.envs.simulation.worlds.registry import world_descriptions

DOCUMENT = Path("docs/simulation.md")


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


_TABLES: dict[str, Callable[[], str]] = {
    "materials": materials_table,
    "worlds": worlds_table,
    "effects": effects_table,
}


def with_tables(text: str) -> str:
    """The text with every table between its two marks, <!-- name --> and <!-- end of name -->."""
    for name, table in _TABLES.items():
        marks = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end of {name} -->)", re.DOTALL)
        text, n = marks.subn(lambda found, t=table: f"{found[1]}{t()}\n{found[2]}", text)  # type: ignore[misc]
        if n != 1:
            raise ValueError(f"the text has {n} places for the table of {name}; it needs one")
    return text


def main() -> int:
    """Write the document anew."""
    DOCUMENT.write_text(with_tables(DOCUMENT.read_text()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
