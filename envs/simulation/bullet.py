"""PyBullet, imported without the line about its build that it prints on the way."""

import importlib
import os
import sys
from typing import Any


def _import_quietly() -> Any:
    """Turn the process's own stderr away for the import: the line comes from C, not from Python."""
    if sys.stderr is None:  # closed, as some services do: descriptor 2 may be anybody's file
        return importlib.import_module("pybullet")
    sys.stderr.flush()
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        return importlib.import_module("pybullet")
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


pybullet: Any = _import_quietly()
