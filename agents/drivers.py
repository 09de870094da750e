"""Drivers by name: the classical ones, and learned ones by their file."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from grouser.agents.driver import Driver
from grouser.agents.dynamic_window import DynamicWindow
from grouser.agents.learned import LearnedDriver
from grouser.agents.pursuit import Pursuit
from grouser.agents.straight import Straight
from grouser.checks import did_you_mean

CLASSICAL: Final[Mapping[str, Callable[[], Driver]]] = {
    "straight": Straight,
    "pursuit": Pursuit,
    "dynamic-window": DynamicWindow,
}
"""Drivers that need no training."""

PRETRAINED: Final = "pretrained"
"""Name of the learned driver that is shipped."""

_SHIPPED = Path(__file__).parent / "policies" / f"{PRETRAINED}.zip"


def make_driver(name: str | Path) -> Driver:
    """A driver by its name, or a learned one by its file.

    Raises:
        ValueError: no driver has that name and no file is there, or the file is no policy.
        ImportError: a learned driver needs a package that is not installed.
    """
    if name in CLASSICAL:
        return CLASSICAL[str(name)]()
    if name == PRETRAINED:
        return LearnedDriver(_SHIPPED)
    if not Path(name).is_file():
        known = (*CLASSICAL, PRETRAINED)
        raise ValueError(
            f"no driver is named {str(name)!r}, and no file is there; "
            f"{did_you_mean(name, known)}known: {', '.join(known)}, and files of policies"
        )
    return LearnedDriver(name)
