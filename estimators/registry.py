"""Estimators by name: `register`, `make`, `names`, and the entry-point group for other packages."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from types import MappingProxyType
from typing import Any

from grouser.checks import did_you_mean
from grouser.estimators.base import TRUTH_KEYS, PoseEstimator
from grouser.rig import Rig

ENTRY_POINT_GROUP = "grouser.estimators"
GROUND_TRUTH = "ground-truth"
EMULATED = "emulated"
TRUTH_READERS = frozenset({GROUND_TRUTH, EMULATED})
"""Names that may read the truth: it itself, and the truth with errors drawn like an estimator's.
Neither is an estimator; nobody else may."""


@dataclass(frozen=True, slots=True)
class EstimatorSpec:
    """Where a named estimator lives and the options that its name stands for."""

    name: str
    entry_point: str
    """"package.module:Class"; imported when the estimator is first made."""
    options: Mapping[str, Any]


_registry: dict[str, EstimatorSpec] = {}


def register(name: str, entry_point: str, **options: Any) -> None:
    """Give a name to an estimator class, "package.module:Class", with options of its own.

    Raises:
        ValueError: the entry point is malformed, or the name already means something else.
    """
    module, colon, class_name = entry_point.partition(":")
    if not (colon and module and class_name.isidentifier()):
        raise ValueError(f"entry point {entry_point!r} of {name!r} is not 'package.module:Class'")
    spec = EstimatorSpec(name, entry_point, MappingProxyType(dict(options)))
    if _registry.get(name, spec) != spec:
        raise ValueError(
            f"estimator {name!r} is registered as {_registry[name].entry_point}; "
            f"choose another name for {entry_point}"
        )
    _registry[name] = spec


def names() -> list[str]:
    """Every registered name, Grouser's own and those of installed packages, sorted."""
    _load_entry_points()
    return sorted(_registry)


def spec(name: str) -> EstimatorSpec:
    """The registration behind a name.

    Raises:
        ValueError: nothing has that name; the message suggests near ones.
    """
    _load_entry_points()
    if name not in _registry:
        hint = did_you_mean(name, _registry)
        raise ValueError(f"no estimator is named {name!r}; {hint}known: {', '.join(names())}")
    return _registry[name]


def estimator_class(name: str) -> type[PoseEstimator]:
    """The class behind a name, checked to be a `PoseEstimator` that does not ask for the truth."""
    entry_point = spec(name).entry_point
    module, _, class_name = entry_point.partition(":")
    try:
        found = getattr(import_module(module), class_name, None)
    except ImportError as error:
        raise ImportError(
            f"estimator {name!r} cannot be imported from {entry_point}: {error}"
        ) from error
    if not (isinstance(found, type) and issubclass(found, PoseEstimator)):
        raise TypeError(f"{entry_point}, registered as {name!r}, is not a PoseEstimator class")
    truth = (found.requires | found.optional) & TRUTH_KEYS
    if truth and name not in TRUTH_READERS:
        raise ValueError(
            f"estimator {name!r} asks for the truth ({sorted(truth)}); none but "
            f"{GROUND_TRUTH!r} and {EMULATED!r} may"
        )
    return found


def optional_keys(name: str, options: Mapping[str, Any]) -> frozenset[str]:
    """The observation keys that an estimator of a name and options reads where the robot has them:
    without a `source` not those that only a source would read."""
    kind = estimator_class(name)
    has_source = {**spec(name).options, **options}.get("source")
    return kind.optional if has_source else kind.optional - kind.optional_for_source


def keys_read(names: Iterable[str]) -> frozenset[str]:
    """The observation keys that estimators of these names read together, where there are such."""
    return frozenset[str]().union(
        *(estimator_class(name).requires | optional_keys(name, {}) for name in names)
    )


def make(name: str, rig: Rig, **options: Any) -> PoseEstimator:
    """An estimator for a robot; options override those that the name was registered with.

    Raises:
        ValueError: an unknown name, or a rig that lacks what the estimator needs.
    """
    return estimator_class(name)(rig, **{**spec(name).options, **options})  # type: ignore[call-arg]


@cache
def _load_entry_points() -> None:
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        try:
            register(entry.name, entry.value)
        except ValueError as error:
            package = entry.dist.name if entry.dist else "?"
            raise ValueError(f"package {package!r}: {error}; or uninstall that package") from error
