"""How the commands' options are named in their help."""

from typing import Any

import tyro


def option(metavar: str) -> Any:
    """An option whose values are called so. Its help text says what happens without it: tyro's own
    "(default: None)" or "(default: ())" would not."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")
