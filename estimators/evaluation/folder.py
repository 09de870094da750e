"""A folder of results that work goes on in: whether it can be written to, and its settings."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

Settings = Mapping[str, Any]
"""What all results of a folder have in common; written as JSON."""

HELD = "results; give --resume to complete them"
"""What most folders hold, for `require_ready`."""

_SETTINGS = "settings.json"


def require_ready(path: Path, settings: Settings, *, begun: bool, resume: bool, holds: str) -> None:
    """Find out before the work whether it may begin in a folder, or go on there.

    Args:
        begun: whether there is something of that work in it.
        resume: whether it may go on with that.
        holds: what that is, and what --resume does with it, in words.

    Raises:
        ValueError: the folder cannot be written to, or the work was begun and may not go on, or
            was begun with other settings.
    """
    require_writable(path)
    if begun:
        if not resume:
            raise ValueError(f"{path} already holds {holds}, or another --output")
        require_settings(path, settings)


def require_writable(path: Path) -> None:
    """Find out before the work, not after it, that its results cannot be written.

    Raises:
        ValueError: the folder, or the nearest one above that there is, cannot be written to.
    """
    there = next(place for place in (path, *path.absolute().parents) if place.exists())
    if not (there.is_dir() and os.access(there, os.W_OK)):
        raise ValueError(
            f"results cannot be written to {path}: {there} is not a folder that you may "
            "write to; choose another --output"
        )


def require_settings(path: Path, settings: Settings) -> None:
    """Check that a folder was begun with these settings.

    Raises:
        ValueError: it was not, and the message says in what they differ; or they cannot be read.
    """
    kept, now = read_json(path / _SETTINGS, dict), _plain(settings)
    if kept == now:
        return
    differing = [
        f"{key} {kept.get(key)!r} (now {now.get(key)!r})"
        for key in sorted({*kept, *now})
        if kept.get(key) != now.get(key)
    ]
    raise ValueError(
        f"{path} was begun with other settings: {'; '.join(differing)}; "
        "runs of different settings are not mixed: choose another --output"
    )


def write_settings(path: Path, settings: Settings) -> None:
    """Say what the folder is begun with."""
    write_json(path / _SETTINGS, _plain(settings))


def read_json(path: Path, kind: type) -> Any:
    """What a file holds, of that type.

    Raises:
        ValueError: it cannot be read, or holds something else.
    """
    try:
        value = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise ValueError(f"{path} cannot be resumed from: {error}") from error
    if not isinstance(value, kind):
        raise ValueError(f"{path} cannot be resumed from: it holds no JSON {kind.__name__}")
    return value


def write_json(path: Path, value: Any) -> None:
    """Write all or nothing: a reader, or a crash, never sees half of a file."""
    partial = path.with_suffix(".partial")
    partial.write_text(json.dumps(value, indent=2, allow_nan=False, default=_number) + "\n")
    os.replace(partial, path)


def _plain(settings: Settings) -> dict[str, Any]:
    """Through JSON and back, to compare with what was read: a tuple becomes a list."""
    plain: dict[str, Any] = json.loads(json.dumps(settings))
    return plain


def _number(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} cannot be written as JSON")
