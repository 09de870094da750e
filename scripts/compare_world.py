"""What the command line says of a simulated world, as options of gym.make."""

from collections.abc import Sequence
from typing import Any

from grouser.scripts.usage import UsageError


def world_options(
    *,
    difficulty: float | None,
    terrain: str | None,
    randomize: Sequence[str],
    dynamics: str | None,
    renderer: str | None,
    effects: Sequence[str],
    faults: Sequence[str],
) -> dict[str, Any]:
    """Those that were given; the environment itself checks their values.

    Args:
        effects: each NAME=AMOUNT.
        faults: each NAME:START:END or NAME:START:END:AMOUNT, s; an empty END means for good.

    Raises:
        UsageError: an effect or a fault that is not written so.
    """
    options: dict[str, Any] = {
        "difficulty": difficulty,
        "terrain": terrain,
        "dynamics": dynamics,
        "renderer": renderer,
        "randomize": list(randomize),
        "effects": dict(_effect(words) for words in effects),
        "faults": [_fault(words) for words in faults],
    }
    return {name: value for name, value in options.items() if value not in (None, [], {})}


def _effect(words: str) -> tuple[str, float]:
    name, _, amount = words.partition("=")
    try:
        return name, float(amount)
    except ValueError as error:
        raise UsageError(
            f"--effects {words!r} is not NAME=AMOUNT, such as stereo.motion_blur=0.01"
        ) from error


def _fault(words: str) -> dict[str, Any]:
    parts = words.split(":")
    try:
        what, start, end, *amount = parts
        fault: dict[str, Any] = {"what": what, "start": float(start)}
        if end:
            fault["end"] = float(end)
        if amount:
            (fault["amount"],) = map(float, amount)
    except ValueError as error:
        raise UsageError(
            f"--faults {words!r} is not NAME:START:END or NAME:START:END:AMOUNT, "
            "such as stereo.darkness:5:8:0.9"
        ) from error
    return fault
