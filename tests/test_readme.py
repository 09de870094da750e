"""What the documents show works: Python runs, commands are understood, links lead somewhere."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import tyro

from grouser.envs.simulation.worlds.registry import world_names
from grouser.estimators import names
from grouser.scripts.cli import COMMANDS as COMMANDS_BY_NAME
from grouser.scripts.compare import Compare
from grouser.scripts.compare_execution import DRIVERS

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text()
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])


def blocks(language: str, document: str = README) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", document, flags=re.MULTILINE | re.DOTALL)


IN_DOCS = [
    block
    for path in DOCUMENTS
    if path.parent.name == "docs"
    for block in blocks("python", path.read_text())
]


COMMANDS = [
    line.removeprefix("$ ")
    for block in blocks("console")
    for line in block.splitlines()
    if line.startswith("$ ")
]


@pytest.mark.parametrize("block", [*blocks("python"), *IN_DOCS])
def test_python_blocks_run(block: str, tmp_path: Path) -> None:
    script = tmp_path / "block.py"
    script.write_text(block)
    done = subprocess.run(
        [sys.executable, "-W", "error", str(script)], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr


def test_the_examples_are_as_short_as_they_claim() -> None:
    example, estimator = blocks("python")
    assert len([line for line in example.splitlines() if line]) <= 9
    body = estimator[estimator.index("class") : estimator.index("register(")]
    assert len([line for line in body.splitlines() if line]) <= 20


@pytest.mark.parametrize("command", [c for c in COMMANDS if c.startswith("make ")])
def test_make_commands_exist(command: str) -> None:
    dry = subprocess.run([*shlex.split(command), "-n"], cwd=ROOT, capture_output=True, text=True)
    assert dry.returncode == 0, dry.stderr


@pytest.mark.parametrize("command", [c for c in COMMANDS if c.startswith("grouser ")])
def test_grouser_commands_are_understood(command: str) -> None:
    program, subcommand, *arguments = shlex.split(command)
    assert program == "grouser"
    options = tyro.cli(COMMANDS_BY_NAME[subcommand], args=arguments)
    if isinstance(options, Compare):
        assert set(options.estimators) <= set(names())
        assert options.driver in {None, *DRIVERS}
        assert options.world in {None, *world_names()}


@pytest.mark.parametrize("command", [c for c in COMMANDS if c.startswith("python ")])
def test_programs_say_what_they_do(command: str) -> None:
    _, *arguments = shlex.split(command)
    done = subprocess.run(
        [sys.executable, *arguments, "--help"], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0 and "usage:" in done.stdout, done.stderr


def test_no_command_goes_unchecked() -> None:
    assert {command.split()[0] for command in COMMANDS} == {"make", "grouser", "python"}


def test_the_tables_list_every_estimator_and_environment() -> None:
    import gymnasium as gym

    environments = {name for name in gym.registry if name.startswith("grouser/")}
    listed = set(re.findall(r"^\| `([^`]+)` \|", README, flags=re.MULTILINE))
    assert listed == environments | set(names())


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_somewhere(document: Path) -> None:
    targets = re.findall(r"\]\(([^)]+)\)", document.read_text())
    local = [target for target in targets if not target.startswith("http")]
    assert [target for target in local if not (document.parent / target).exists()] == []
