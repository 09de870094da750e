"""Rooms import only from floors below them, absolutely, and the two wings not each other.

floor 4  scripts/
floor 3  agents/
floor 2  envs/    estimators/
floor 1  grouser/
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FLOORS = {"grouser": 1, "envs": 2, "estimators": 2, "agents": 3, "scripts": 4}


def imported_modules(tree: ast.AST) -> Iterator[str]:
    """Every module that a file imports, at the top or inside a function."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level:
            yield "." * node.level + (node.module or "")
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""
            # `from grouser import envs` names a room only after the import.
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def room_of(module: str) -> str | None:
    """The room that an absolute module name lies in; None outside the project."""
    top, *rest = module.split(".")
    if top != "grouser":
        return None
    return rest[0] if rest and rest[0] in FLOORS else "grouser"


def violations(room: str, source: str) -> list[str]:
    """What a file of a room imports against the rules."""
    found = []
    for module in imported_modules(ast.parse(source)):
        target = room_of(module)
        if module.startswith("."):
            found.append(f"relative import {module!r}: import absolutely")
        elif module.split(".")[0] in FLOORS and target is None:
            found.append(f"import of {module!r}: its import name is 'grouser.{module}'")
        elif target is not None and target != room and FLOORS[target] >= FLOORS[room]:
            found.append(f"{room}/ (floor {FLOORS[room]}) imports {module!r} of {target}/")
    return found


def source_files() -> list[Path]:
    return sorted(
        path
        for room in FLOORS
        for path in (ROOT / room).rglob("*.py")
        if not any((ROOT / folder).is_symlink() for folder in path.relative_to(ROOT).parents)
    )


@pytest.mark.parametrize("path", source_files(), ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_imports_upwards(path: Path) -> None:
    room = path.relative_to(ROOT).parts[0]
    assert violations(room, path.read_text()) == []


def test_the_walk_visits_every_room_once() -> None:
    files = source_files()
    assert {path.relative_to(ROOT).parts[0] for path in files} == set(FLOORS)
    assert len({path.resolve() for path in files}) == len(files)


@pytest.mark.parametrize(
    ("room", "line", "words"),
    [
        ("grouser", "import grouser.envs.replay", "floor 1"),
        ("grouser", "from grouser import estimators", "estimators/"),
        ("envs", "from grouser.estimators import make", "envs/ (floor 2) imports"),
        (
            "estimators",
            "from grouser.envs.simulation import robot",
            "estimators/ (floor 2) imports",
        ),
        ("estimators", "def f():\n    from grouser.agents import waypoints", "agents/"),
        ("agents", "import grouser.scripts.cli", "scripts/"),
        ("scripts", "import envs", "its import name is 'grouser.envs'"),
        ("scripts", "from estimators.base import Status", "'grouser.estimators.base'"),
        ("envs", "from . import sensors", "import absolutely"),
        ("envs", "from ..estimators import base", "import absolutely"),
    ],
)
def test_the_walk_catches_each_kind_of_violation(room: str, line: str, words: str) -> None:
    assert any(words in found for found in violations(room, line))


@pytest.mark.parametrize(
    ("room", "line"),
    [
        ("scripts", "from grouser.agents.waypoints import Waypoints"),
        ("agents", "from grouser.envs.tracked_robot import TrackedRobotEnv"),
        ("estimators", "from grouser import geometry\nfrom grouser.geometry import Array"),
        ("envs", "import numpy as np\nfrom grouser.envs.sensors import lidar"),
    ],
)
def test_the_walk_lets_downward_imports_pass(room: str, line: str) -> None:
    assert violations(room, line) == []
