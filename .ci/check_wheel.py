"""The wheel holds each module once, under the one name `grouser`, the data that comes with some,
and nothing else."""

import sys
import zipfile
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("envs", "estimators", "agents", "scripts")
DATA = ("agents/policies/*.zip", "estimators/emulation/fits/*.json")
"""The pretrained policy, and the emulators of estimators."""


def expected() -> set[str]:
    own = {f"grouser/{path.name}" for path in (ROOT / "grouser").glob("*.py")}
    rooms = {
        f"grouser/{path.relative_to(ROOT).as_posix()}"
        for room in ROOMS
        for path in (ROOT / room).rglob("*.py")
    }
    data = {
        f"grouser/{path.relative_to(ROOT).as_posix()}"
        for pattern in DATA
        for path in ROOT.glob(pattern)
    }
    return own | rooms | data | {"grouser/py.typed"}


def main(wheel: str) -> None:
    with zipfile.ZipFile(wheel) as archive:
        shipped = [name for name in archive.namelist() if ".dist-info/" not in name]
    if len(shipped) != len(set(shipped)):
        sys.exit(f"{wheel} holds a file twice")
    missing, surplus = expected() - set(shipped), set(shipped) - expected()
    if missing or surplus:
        sys.exit(f"{wheel} lacks {sorted(missing)} and should not hold {sorted(surplus)}")
    modules = sum(PurePosixPath(name).suffix == ".py" for name in shipped)
    print(f"{PurePosixPath(wheel).name}: {modules} modules, each once")


main(sys.argv[1])
