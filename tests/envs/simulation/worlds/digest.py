"""A world's bits in one word."""

import hashlib
from collections.abc import Collection
from dataclasses import fields, is_dataclass

import numpy as np

from grouser.envs.simulation.world import World


def digest(world: World, *, only: str = "", but: Collection[str] = ()) -> str:
    """Of all parts of a world, of one, or of all but some."""
    names = [f.name for f in fields(world) if f.name not in but and only in ("", f.name)]
    hashed = hashlib.sha256()
    for name in names:
        for bits in _bits(getattr(world, name)):
            hashed.update(bits)
    return hashed.hexdigest()


def _bits(value: object) -> list[bytes]:
    if is_dataclass(value):
        return [bits for f in fields(value) for bits in _bits(getattr(value, f.name))]
    if isinstance(value, np.ndarray):
        return [repr((value.shape, value.dtype)).encode(), value.tobytes()]
    return [repr(value).encode()]
