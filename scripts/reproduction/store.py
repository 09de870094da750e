"""Experiments that were done, on disk, so that a long run can be killed and continued.

settings.json              what all experiments have in common
experiments/NAME.npz       the outcome of an experiment, whole or not there
"""

import os
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from grouser.estimators.evaluation.folder import (
    Settings,
    require_ready,
    write_settings,
)
from grouser.scripts.reproduction.experiment import Outcome

_HELD = "experiments; give --resume to go on with them"


class ExperimentStore:
    """The folder of a reproduction; several processes may write to it, each its experiments."""

    def __init__(self, path: Path, settings: Settings, *, resume: bool) -> None:
        """Find the folder, which `begin` makes.

        Raises:
            ValueError: the folder cannot be written to, or it holds experiments already and
                `resume` is not set, or it holds those of other settings.
        """
        self.path = path
        self._settings = settings
        begun = any(self._folder.glob("*.npz"))
        require_ready(path, settings, begun=begun, resume=resume, holds=_HELD)

    def begin(self) -> None:
        """Make the folder, and say in it what its experiments have in common."""
        self._folder.mkdir(parents=True, exist_ok=True)
        write_settings(self.path, self._settings)

    def has(self, name: str) -> bool:
        """Whether that experiment was done."""
        return self._file(name).exists()

    def keep(self, name: str, outcome: Outcome) -> None:
        """Write all or nothing of an outcome."""
        partial = self._file(name).with_suffix(".partial")
        arrays: dict[str, Any] = dict(outcome)
        with partial.open("wb") as file:
            np.savez_compressed(file, **arrays)
        os.replace(partial, self._file(name))

    def read(self, name: str) -> Outcome:
        """What was kept.

        Raises:
            ValueError: it cannot be read.
        """
        path = self._file(name)
        try:
            with np.load(path, allow_pickle=False) as kept:
                return {key: kept[key] for key in kept.files}
        except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
            raise ValueError(
                f"{path} cannot be read ({error}); delete it, and --resume does it again"
            ) from error

    @property
    def _folder(self) -> Path:
        return self.path / "experiments"

    def _file(self, name: str) -> Path:
        return self._folder / f"{name}.npz"
