"""What docs/estimators.md says of each estimator: read from its class, so that it stays true."""

import ast
import inspect
import re
import textwrap
import typing
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any

from grouser.estimators import names
from grouser.estimators.base import PoseEstimator
from grouser.estimators.registry import estimator_class, spec

_OWN = "grouser."


def estimator_sections() -> str:
    """A section a class: the names it goes by, what it is, what it reads and its options."""
    return "\n\n".join(_section(kind, of_it) for kind, of_it in _own_kinds().items())


def option_group_sections() -> str:
    """A table for each dataclass of options that an estimator takes."""
    groups = {group.__name__: group for kind in _own_kinds() for group in _option_groups(kind)}
    return "\n\n".join(_group_section(groups[name]) for name in sorted(groups))


def _own_kinds() -> dict[type[PoseEstimator], list[str]]:
    """Grouser's own estimators, with the names of each."""
    kinds: dict[type[PoseEstimator], list[str]] = {}
    for name in names():
        if spec(name).entry_point.startswith(_OWN):
            kinds.setdefault(estimator_class(name), []).append(name)
    return kinds


def _section(kind: type[PoseEstimator], of_it: list[str]) -> str:
    title = ", ".join(f"`{name}`" for name in of_it)
    set_by_name = [line for name in of_it if (line := _preset(name))]
    parts = [
        f"### {title}",
        _paragraphs(inspect.getdoc(kind) or ""),
        f"Reads {_keys(kind.requires)}{_where_there(kind.optional)}{_one_of(kind)}.",
        "\n".join(set_by_name),
        _options_table(kind),
    ]
    return "\n\n".join(part for part in parts if part)


def _preset(name: str) -> str:
    options: Mapping[str, Any] = spec(name).options
    said = ", ".join(f"`{key}={value!r}`" for key, value in options.items())
    return f"- `{name}` is {said}" if said else ""


def _one_of(kind: type[PoseEstimator]) -> str:
    return "".join(f", one of {_keys(group)} at least" for group in kind.requires_one_of)


def _keys(keys: frozenset[str]) -> str:
    return ", ".join(f"`{key}`" for key in sorted(keys))


def _where_there(keys: frozenset[str]) -> str:
    return f", and where the robot has them {_keys(keys)}" if keys else ""


def _options_table(kind: type[PoseEstimator]) -> str:
    parameters = inspect.signature(kind).parameters.values()
    options = [p for p in parameters if p.kind is p.KEYWORD_ONLY]
    if not options:
        return "It has no options."
    told = option_texts(inspect.getdoc(kind.__init__) or "")
    untold = [p.name for p in options if p.name not in told]
    if untold:
        raise ValueError(f"{kind.__name__} does not document its options {untold}")
    lines = ["| option | default | |", "|---|---|---|"]
    lines += [f"| `{p.name}` | `{p.default!r}` | {told[p.name]} |" for p in options]
    return "\n".join(lines)


def _option_groups(kind: type[PoseEstimator]) -> Iterator[type[Any]]:
    """The dataclasses among the types of a constructor's keywords; a rig is none of its options."""
    hints = typing.get_type_hints(kind.__init__)
    for name, parameter in inspect.signature(kind).parameters.items():
        if parameter.kind is parameter.KEYWORD_ONLY:
            candidates = (hints[name], *typing.get_args(hints[name]))
            yield from (one for one in candidates if _is_option_group(one))


def _is_option_group(candidate: object) -> bool:
    """Whether it is a dataclass that may be left as it is: a value such as a map is not."""
    if not (isinstance(candidate, type) and is_dataclass(candidate)):
        return False
    return all(_default(f) is not MISSING for f in fields(candidate))


def _default(field: Field[Any]) -> Any:
    return field.default if field.default_factory is MISSING else field.default_factory()


def _group_section(group: type[Any]) -> str:
    told = field_texts(group)
    lines = [f"| `{f.name}` | `{_default(f)!r}` | {told.get(f.name, '')} |" for f in fields(group)]
    described = _paragraphs(inspect.getdoc(group) or "")
    where = f"`from {group.__module__} import {group.__name__}`"
    head = f"### `{group.__name__}`\n\n{described}\n\n{where}\n\n| field | default | |"
    return "\n".join([head, "|---|---|---|", *lines])


def field_texts(group: type[Any]) -> dict[str, str]:
    """What stands below each field of a dataclass, in one line, by name."""
    (body,) = ast.parse(textwrap.dedent(inspect.getsource(group))).body
    assert isinstance(body, ast.ClassDef)
    told = {}
    for field, below in zip(body.body, body.body[1:], strict=False):
        if not (isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)):
            continue
        if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            told[field.target.id] = _one_line(str(below.value.value)).replace("|", "\\|")
    return told


def option_texts(docstring: str) -> dict[str, str]:
    """The entries of a docstring's "Args:", each in one line, by name."""
    _, _, after = docstring.partition("Args:\n")
    block = re.split(r"\n(?=\S)", after, maxsplit=1)[0]
    entries = re.findall(r"^    (\w+): (.*(?:\n {5,}.*)*)", block, re.MULTILINE)
    return {name: _one_line(text).replace("|", "\\|") for name, text in entries}


def _paragraphs(docstring: str) -> str:
    return "\n\n".join(_one_line(part) for part in docstring.split("\n\n"))


def _one_line(text: str) -> str:
    return re.sub(r"\s+", " ", text).strip()
