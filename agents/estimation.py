"""Whose pose: estimators by name, and emulators by the model that their errors are drawn from."""

from typing import Any, Final

_EMULATED: Final = "emulated"


def emulated(of: str) -> str:
    """The name of an emulator.

    Args:
        of: an estimator of `emulation.model_file.fitted_names()`, or a JSON file.
    """
    return f"{_EMULATED}:{of}"


def estimation(name: str) -> dict[str, Any]:
    """Arguments of `GoalNavEnv` for the name of an estimator, or of an emulator as `emulated`
    makes it."""
    kind, _, of = name.partition(":")
    if kind == _EMULATED and of:
        return {"estimator": kind, "estimator_options": {"of": of}}
    return {"estimator": name}
