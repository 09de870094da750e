"""Error models as JSON files: those that come with Grouser, and one's own."""

import json
from importlib.resources import files
from pathlib import Path

from grouser.checks import did_you_mean
from grouser.estimators.emulation.error_model import ErrorModel

_FITS = files("grouser.estimators.emulation").joinpath("fits")


def fitted_names() -> list[str]:
    """Estimators of which Grouser brings an error model, sorted."""
    entries = (entry.name for entry in _FITS.iterdir())
    return sorted(name.removesuffix(".json") for name in entries if name.endswith(".json"))


def load_model(of: str) -> ErrorModel:
    """The error model of an estimator that `fitted_names` lists, or of a JSON file.

    Raises:
        ValueError: there is no such fit, or the file holds something else.
    """
    if of.endswith(".json"):
        return _parsed(Path(of).read_text() if Path(of).is_file() else None, of)
    names = fitted_names()
    if of not in names:
        raise ValueError(
            f"no emulator of {of!r} comes with Grouser; {did_you_mean(of, names)}known: "
            f"{', '.join(names)}; `grouser fit-emulator` makes others, named by their file, .json"
        )
    return _parsed(_FITS.joinpath(f"{of}.json").read_text(), of)


def save_model(path: Path, model: ErrorModel) -> None:
    """Write a model as JSON."""
    path.write_text(json.dumps(model.to_json(), indent=1) + "\n")


def _parsed(text: str | None, of: str) -> ErrorModel:
    if text is None:
        raise ValueError(f"there is no file {of}; `grouser fit-emulator` makes one")
    try:
        values = json.loads(text)
        if not isinstance(values, dict):
            raise ValueError("it holds no JSON object")
        return ErrorModel.from_json(values)
    except ValueError as error:
        raise ValueError(f"{of} is no emulator: {error}") from error
