"""The numbers of a reproduction by name: what results.json holds, and all that a page may show."""

import math
from collections.abc import Mapping

Figures = dict[str, float | None]
"""Dotted name to value; None where a figure does not exist."""


def named(prefix: str, values: Mapping[str, float | None]) -> Figures:
    """These values under `prefix.`; what is no finite number does not exist."""
    return {f"{prefix}.{name}": _number(value) for name, value in values.items()}


def _number(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)
