"""Fig. 3 from the code's own stages: who calls whom in one update, as it is seen to happen.

Nothing of it is written down: an update of the estimator is watched, and what it calls is drawn.
So the diagram shows the code that ran, with the first words of its own documentation.
"""

import inspect
import sys
from dataclasses import dataclass, field
from itertools import groupby
from textwrap import fill
from types import FrameType
from typing import Any

import numpy as np

from grouser.estimators import registry
from grouser.estimators.synthetic_drive import synthetic_drive
from grouser.scripts.reproduction.drawing import COLORS, new_figure
from grouser.scripts.reproduction.page import Paragraph, Picture, Section
from grouser.scripts.reproduction.zhao.contenders import RECOMMENDED

_PACKAGE = "grouser.estimators."
_FRAMES = 5  # the last of which is watched: by then, nothing is new to the estimator


@dataclass(slots=True)
class Call:
    """A call that was seen."""

    name: str
    """Such as KeyframeSight.look."""
    module: str
    says: str
    """The first sentence of its documentation."""
    is_method: bool
    calls: list["Call"] = field(default_factory=list)

    @property
    def is_public(self) -> bool:
        return not self.name.rpartition(".")[2].startswith(("_", "<"))


def watched_update(name: str = RECOMMENDED) -> Call:
    """The tree of calls within the estimators' package in one update."""
    drive = synthetic_drive(frames=_FRAMES, blackout=range(0))
    estimator = registry.make(name, drive.rig)
    estimator.reset(drive.observations[0], rng=np.random.default_rng(0))
    for observation in drive.observations[1:-1]:
        estimator.update(observation)
    root = Call("", "", "", False)
    open_calls: list[tuple[FrameType | None, Call]] = [(None, root)]

    def watch(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_globals.get("__name__", "").startswith(_PACKAGE):
            call = _call(frame)
            open_calls[-1][1].calls.append(call)
            open_calls.append((frame, call))
        elif event == "return" and open_calls[-1][0] is frame:
            open_calls.pop()

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        estimator.update(drive.observations[-1])
    finally:
        sys.setprofile(before)
    return root.calls[0]


def stages(update: Call) -> list[Call]:
    """The steps of an update: public methods of its parts, each with what is public within it.

    An update that only hands on to another object's, and at most asks whether it may, is that
    object's. A private function is only a part of its caller's text: what it calls, its caller
    calls. A step that is called again at once is one step.
    """
    inner = _public(update)
    handed_on = [call for call in inner if call.name.endswith(".update")]
    if len(handed_on) == 1 and all(call is handed_on[0] or not _public(call) for call in inner):
        return stages(handed_on[0])
    methods = [call for call in inner if call.is_method]
    return [next(again) for _, again in groupby(methods, key=lambda call: call.name)]


def parts(stage: Call) -> list[str]:
    """Names of what is public within a stage, each once, in the order of the first call."""
    return list(dict.fromkeys(call.name for call in _public(stage)))


def pipeline_section() -> Section:
    """Fig. 3."""
    return Section(
        "The pipeline",
        [
            Paragraph(
                "The paper's fig. 3, as the code does it: the calls of one update, watched when "
                "this page was made. On the left the steps in their order, on the right what each "
                "of them consists of."
            ),
            Picture("Fig. 3, from the code's own stages.", _diagram(stages(watched_update()))),
        ],
    )


def _public(call: Call) -> list[Call]:
    found = []
    for inner in call.calls:
        found += [inner] if inner.is_public else _public(inner)
    return found


def _call(frame: FrameType) -> Call:
    name, module = frame.f_code.co_name, frame.f_globals["__name__"]
    owner = frame.f_locals.get("self")
    function = frame.f_globals.get(name) if owner is None else getattr(type(owner), name, None)
    says = (inspect.getdoc(function) or "").split(". ")[0].split("\n\n")[0].replace("\n", " ")
    full_name = name if owner is None else f"{type(owner).__name__}.{name}"
    return Call(full_name, module.removeprefix(_PACKAGE), says, owner is not None)


def _diagram(steps: list[Call]) -> Any:
    height = 0.78 * len(steps)
    figure, axes = new_figure(11, height)
    area = axes[0, 0]
    area.set_axis_off()
    area.set_xlim(0, 11)
    area.set_ylim(-len(steps) + 0.4, 0.6)
    modules = list(dict.fromkeys(step.module for step in steps))
    for row, step in enumerate(steps):
        color = COLORS[modules.index(step.module) % len(COLORS)]
        _box(area, -row, step, color)
        area.text(4.45, -row, _in_lines(", ".join(parts(step)), 86), va="center", fontsize=7.5)
        if row:
            area.annotate(
                "", (2.1, -row + 0.34), (2.1, -row + 0.66), arrowprops={"arrowstyle": "->"}
            )
    return figure


def _box(area: Any, y: float, step: Call, color: str) -> None:
    from matplotlib.patches import FancyBboxPatch

    outline = FancyBboxPatch(
        (0.1, y - 0.3), 4.0, 0.6, boxstyle="round,pad=0.03", fc=color, ec=color, alpha=0.18
    )
    area.add_patch(outline)
    area.text(0.2, y + 0.1, step.name, va="center", fontsize=9, fontweight="bold")
    area.text(4.0, y + 0.1, step.module, va="center", ha="right", fontsize=6.5, color=color)
    area.text(0.2, y - 0.15, _shortened(step.says, 66), va="center", fontsize=6.5)


def _shortened(words: str, most: int) -> str:
    return (
        words
        if len(words) <= most
        else words[: most - 1].rpartition(" ")[0] + "\N{HORIZONTAL ELLIPSIS}"
    )


def _in_lines(words: str, most: int) -> str:

    return fill(words, most, max_lines=3)
