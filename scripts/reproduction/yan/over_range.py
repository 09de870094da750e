"""How far the third line is seen where it goes on beyond the sensor's range."""

from dataclasses import dataclass

import numpy as np

from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome, Outcomes
from grouser.scripts.reproduction.figures import Figures
from grouser.scripts.reproduction.page import (
    Cell,
    Number,
    Paragraph,
    Row,
    Section,
    Table,
    plus_minus,
)
from grouser.scripts.reproduction.yan.contests import contest_name
from grouser.scripts.reproduction.yan.drives import course, line_world
from grouser.scripts.reproduction.yan.forms import CORRECTED, FORMS
from grouser.scripts.reproduction.yan.maps import THIRD
from grouser.scripts.reproduction.yan.paper import WORLDS

NAME = "farthest-visible"

_TRUE_END = {"normal": 45.0, "over_range": 60.0}
"""x of the third line's right end, m."""


@dataclass(frozen=True, slots=True)
class FarthestVisible(Experiment):
    """What is truly within the sensor's range on the way: no noise, no filter."""

    name: str = NAME

    @property
    def parts(self) -> int:
        return len(WORLDS)

    def run(self, on_part: OnPart) -> Outcome:
        """Largest x of the third line by world, m; `every_step` where the sensor always looks."""
        farthest = {"every_step": np.array(_farthest(WORLDS["over_range"], observe_every=1))}
        for name, world in WORLDS.items():
            farthest[name] = np.array(_farthest(world))
            on_part()
        return farthest


def over_range_figures(visible: Outcome, drives: Outcomes) -> Figures:
    """What was visible, and where the maps end."""
    figures: Figures = {
        "noise_free_end_m": float(visible["over_range"]),
        "noise_free_end_every_step_m": float(visible["every_step"]),
        "noise_free_normal_end_m": float(visible["normal"]),
        **{f"true_end.{world}_m": x for world, x in _TRUE_END.items()},
    }
    for world in WORLDS:
        outcome = drives[contest_name(world)]
        for form in FORMS:
            ends = outcome[f"{form}.third_end"]
            ends = ends[np.isfinite(ends)]
            figures[f"end.{world}.{form}_m"] = float(ends.mean()) if len(ends) else None
            figures[f"end.{world}.{form}_deviation_m"] = float(ends.std()) if len(ends) else None
            figures[f"end.{world}.{form}_largest_m"] = float(ends.max()) if len(ends) else None
    return figures | {"over_range_end_m": figures[f"end.over_range.{CORRECTED}_m"]}


def over_range_section() -> Section:
    """The table."""
    rows = [
        Row("the paper", ["", Number("paper.over_range_end_m", 4), ""], from_paper=True),
        Row("visible, without noise",
            [Number("noise_free_normal_end_m", 3), Number("noise_free_end_m", 3), ""]),
    ]  # fmt: skip
    for form, contestant in FORMS.items():
        cells: list[Cell] = [
            _end("normal", form),
            _end("over_range", form),
            Number(f"end.over_range.{form}_largest_m", 2),
        ]
        rows.append(Row(contestant.words, cells, stressed=form == CORRECTED))
    return Section(
        "The line that is longer than can be seen",
        [
            Paragraph(_TEXT),
            Table(
                "Right end of the third line in the map: x in the world, m; mean and standard "
                "deviation over {monte_carlo.runs:.0f} drives.",
                ["", "normal run", "over-range run", "its largest"],
                rows,
            ),
        ],
    )


_TEXT = (
    "The paper makes the third line end at x = {true_end.over_range_m:.0f} m instead of "
    "{true_end.normal_m:.0f} m, and finds that its filter "
    "knows it up to {paper.over_range_end_m:.4f} m, from one run. What is within the range of 30 m "
    "from the true way at all ends at {noise_free_end_m:.3f} m "
    "({noise_free_end_every_step_m:.3f} m where the sensor looks at every step), so that the "
    "paper's number is the truth and a noise of about a standard deviation. The map here takes of "
    "every end that was seen only what lies one standard deviation further in: the farthest of "
    "many noisy ends would lie too far out."
)


def _end(world: str, form: str) -> tuple[str | Number, ...]:
    key = f"end.{world}.{form}"
    return plus_minus(Number(f"{key}_m", 2), Number(f"{key}_deviation_m", 2))


def _farthest(world: str, **options: int) -> float:
    env = line_world(world, sensors=(), noise=0.0, **options)
    _, info = env.reset(seed=0)
    farthest = 0.0
    for action in course(world):
        *_, info = env.step(action)
        farthest = max(farthest, float(info["true_visible"][THIRD, [0, 2]].max()))
    return farthest
