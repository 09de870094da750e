"""`make` finds a Python that works by running it, says so where there is none, installs once."""

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
TOOLS = ("sh", "make", "cat", "dirname", "rm", "rmdir", "mkdir", "cp", "sed")

# Stands for a Python of some version: answers the probes, makes fake environments, logs installs.
FAKE = """#!/bin/sh
case "$*" in
  *ensurepip*) printf '%s' "{version} {tools}" ;;
  *"print(sys.version)"*) echo "{version}.0 (fake)" ;;
  "-m venv "*) mkdir -p "$3/bin" && cp "$0" "$3/bin/python" && echo venv >>"{log}" ;;
  "-m pip install "*) echo "install $*" >>"{log}" ;;
esac
"""


class Machine:
    """A folder that stands for all that is on PATH."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.log = root / "log"
        self.folders: list[Path] = []
        tools = self.folder("tools")
        for tool in TOOLS:
            found = shutil.which(tool)
            assert found, f"these tests need {tool}"
            (tools / tool).symlink_to(found)

    def folder(self, name: str) -> Path:
        path = self.root / name
        path.mkdir(exist_ok=True)
        self.folders.append(path)
        return path

    def python(self, name: str, version: str, *, tools: str = "venv", folder: str = "bin") -> Path:
        text = FAKE.format(version=version, tools=tools, log=self.log)
        return self.executable(folder, name, text)

    def executable(self, folder: str, name: str, text: str) -> Path:
        path = self.folder(folder) / name
        path.write_text(text)
        path.chmod(0o755)
        return path

    def run(
        self, *command: str, variables: dict[str, str] | None = None, cwd: Path = ROOT
    ) -> tuple[int, str, str]:
        path = ":".join(str(folder) for folder in self.folders)
        environment = {"PATH": path, "HOME": str(self.root), **(variables or {})}
        done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True)
        return done.returncode, done.stdout.strip(), done.stderr

    def find_python(self, **variables: str) -> tuple[int, str, str]:
        return self.run(str(ROOT / ".ci/find-python"), variables=variables)

    def logged(self) -> list[str]:
        return self.log.read_text().splitlines() if self.log.exists() else []


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_a_shim_that_fails_is_passed_over(machine: Machine) -> None:
    machine.executable("shims", "python3.11", "#!/bin/sh\necho not installed >&2\nexit 127\n")
    good = machine.python("python3.11", "3.11")
    assert machine.find_python() == (0, str(good), "")


def test_the_newer_of_two_good_ones_is_chosen_wherever_it_is(machine: Machine) -> None:
    machine.python("python3", "3.10", folder="first")
    good = machine.python("python", "3.11", folder="second")
    assert machine.find_python() == (0, str(good), "")


def test_python_3_10_will_do(machine: Machine) -> None:
    machine.python("python3", "3.12")
    good = machine.python("python3.10", "3.10")
    assert machine.find_python() == (0, str(good), "")


def test_one_that_path_hides_is_found_under_pyenv(machine: Machine) -> None:
    hidden = machine.root / ".pyenv/versions/3.11.9/bin"
    hidden.mkdir(parents=True)
    shutil.copy(machine.python("python3", "3.11", folder="elsewhere"), hidden / "python3")
    machine.folders.pop()
    assert machine.find_python() == (0, str(hidden / "python3"), "")


def test_the_one_that_is_named_is_used_or_refused(machine: Machine) -> None:
    machine.python("python3.11", "3.11")
    named = machine.python("python3", "3.10")
    assert machine.find_python(PYTHON=str(named))[:2] == (0, str(named))
    old = machine.python("python3.8", "3.8")
    code, out, said = machine.find_python(PYTHON=str(old))
    assert (code, out) == (1, "") and f"too old: {old} (3.8)" in said
    code, out, said = machine.find_python(PYTHON="python9")
    assert (code, out, said) == (1, "", "PYTHON=python9 is not there\n")


def test_a_python_without_venv_is_named_with_the_remedy(machine: Machine) -> None:
    bare = machine.python("python3", "3.11", tools="bare")
    code, out, said = machine.find_python()
    assert (code, out) == (1, "")
    assert f"without venv and ensurepip: {bare} (3.11)" in said
    assert "sudo apt-get install python3-venv" in said


@pytest.mark.parametrize("target", ["demo", "test", "lint"])
def test_make_says_what_to_do_where_only_a_newer_python_is(machine: Machine, target: str) -> None:
    python = machine.python("python3", "3.12")
    venv = machine.root / "venv"
    code, _, said = machine.run("make", target, variables={"VENV": str(venv)})
    assert code != 0 and not venv.exists()
    assert "Grouser needs Python 3.11 or 3.10: PyBullet, its physics engine, has no wheels" in said
    assert f"too new: {python} (3.12)" in said
    assert "Install one beside what you have, and type make again" in said
    assert "make PYTHON=/path/to/python3.11" in said


def test_make_says_what_to_do_where_there_is_no_python(machine: Machine) -> None:
    code, _, said = machine.run("make", "test", variables={"VENV": str(machine.root / "venv")})
    assert code != 0 and "Grouser needs Python 3.11 or 3.10" in said and "too" not in said


@pytest.fixture
def checkout(machine: Machine) -> Path:
    """Enough of a clone for .ci/ensure-venv."""
    folder = machine.root / "clone"
    (folder / ".ci").mkdir(parents=True)
    for name in ("pyproject.toml", "constraints-ci.txt", ".ci/find-python", ".ci/ensure-venv"):
        shutil.copy(ROOT / name, folder / name)
    return folder


def ensure(machine: Machine, checkout: Path, *arguments: str, **variables: str) -> list[str]:
    """Run ensure-venv; what it did, without pip's constant arguments."""
    seen = len(machine.logged())
    script = str(checkout / ".ci/ensure-venv")
    code, _, said = machine.run(script, *arguments, variables=variables, cwd=checkout)
    assert code == 0, said
    constant = "install -m pip install --quiet --disable-pip-version-check "
    return [line.removeprefix(constant) for line in machine.logged()[seen:]]


def test_the_environment_is_made_once_and_refreshed_when_stale(
    machine: Machine, checkout: Path
) -> None:
    machine.python("python3.11", "3.11")
    assert ensure(machine, checkout, "dev") == ["venv", "-e .[dev]"]
    assert ensure(machine, checkout, "dev") == []
    assert ensure(machine, checkout, "plot") == ["-e .[plot]"]
    assert ensure(machine, checkout, "dev") == []
    with (checkout / "pyproject.toml").open("a") as file:
        file.write("# another dependency\n")
    assert ensure(machine, checkout, "dev") == ["-e .[dev]"]
    assert ensure(machine, checkout, "dev", "-c", "x.txt") == ["-e .[dev] -c x.txt"]
    (checkout / ".venv/bin/python").write_text("#!/bin/sh\nexit 1\n")
    assert ensure(machine, checkout, "dev") == ["venv", "-e .[dev]"]


def test_a_folder_that_is_no_environment_is_left_alone(machine: Machine, checkout: Path) -> None:
    machine.python("python3.11", "3.11")
    (machine.root / "home").mkdir()
    (machine.root / "home/thesis.txt").write_text("years of work")
    script, home = str(checkout / ".ci/ensure-venv"), str(machine.root / "home")
    code, _, said = machine.run(script, "dev", variables={"VENV": home}, cwd=checkout)
    assert code == 1 and f"{home} is there and is no virtual environment; move it away" in said
    assert (machine.root / "home/thesis.txt").read_text() == "years of work"
    (machine.root / "empty").mkdir()
    empty = str(machine.root / "empty")
    assert ensure(machine, checkout, "dev", VENV=empty) == ["venv", "-e .[dev]"]


def test_another_python_makes_another_environment(machine: Machine, checkout: Path) -> None:
    machine.python("python3.11", "3.11")
    other = machine.python("python3.10", "3.10")
    assert ensure(machine, checkout, "dev") == ["venv", "-e .[dev]"]
    assert ensure(machine, checkout, "dev", PYTHON=str(other)) == ["venv", "-e .[dev]"]
    assert ensure(machine, checkout, "dev", PYTHON=str(other)) == []


def test_a_moved_clone_is_installed_anew(machine: Machine, checkout: Path) -> None:
    machine.python("python3.11", "3.11")
    ensure(machine, checkout, "dev")
    moved = checkout.rename(machine.root / "moved")
    assert ensure(machine, moved, "dev") == ["-e .[dev]"]


def test_make_lists_its_commands(machine: Machine) -> None:
    code, listed, _ = machine.run("make")
    assert code == 0
    for command in ("make demo", "make test", "make lint", "make clean"):
        assert command in listed
