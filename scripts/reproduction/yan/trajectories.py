"""Figs. 6 to 9: one drive in each world, the map that it left, and its errors."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from grouser.envs.plane.world import make_plane_world
from grouser.estimators.line_slam.map import LineMapper
from grouser.geometry import Array, compose, wrap
from grouser.scripts.reproduction.drawing import finish, new_figure
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome, Outcomes
from grouser.scripts.reproduction.figures import Figures, named
from grouser.scripts.reproduction.page import Paragraph, Picture, Section
from grouser.scripts.reproduction.yan.drives import line_world, rig_of, watch
from grouser.scripts.reproduction.yan.forms import CORRECTED, FORMS, make_form
from grouser.scripts.reproduction.yan.maps import ends_in_world
from grouser.scripts.reproduction.yan.paper import WORLDS

_SEED = 0
_AXES = (("x", "m", 1.0), ("y", "m", 1.0), ("heading", "deg", float(np.degrees(1.0))))
_TRUE, _FOUND = "#C0392B", "#1F5FBF"
"""The paper's colours: what is there red, what the filter says blue."""


@dataclass(frozen=True, slots=True)
class Trajectory(Experiment):
    """The corrected filter on one drive."""

    world: str

    @property
    def name(self) -> str:
        return f"trajectory-{self.world}"

    def run(self, on_part: OnPart) -> Outcome:
        """`true_pose`, `pose` (N, 3), `sigma` (N, 3) and `stamps` (N,) in the frame of the start;
        `ends` (n, 2, 2) of the map's lines in the world, and whether they are `open`."""
        env = line_world(self.world, sensors=("steering", "lines"))
        estimator = make_form(FORMS[CORRECTED], rig_of(env))
        (run,) = watch(env, self.world, {CORRECTED: estimator}, _SEED)
        assert run.true_poses is not None and isinstance(estimator, LineMapper)
        on_part()
        return {
            "stamps": run.stamps,
            "true_pose": run.true_poses,
            "pose": np.array([e.pose for e in run.estimates]),
            "sigma": np.array([np.sqrt(np.diag(e.covariance)) for e in run.estimates]),
            "ends": ends_in_world(estimator.map, make_plane_world(self.world).start),
            "open": estimator.map.open_ends,
        }


def trajectory_experiments() -> list[Experiment]:
    """One a world."""
    return [Trajectory(world) for world in WORLDS.values()]


def trajectory_figures(outcomes: Outcomes) -> Figures:
    """How long the drives are, and how large their errors."""
    figures: Figures = {}
    for world in WORLDS:
        outcome = outcomes[f"trajectory-{WORLDS[world]}"]
        place = np.linalg.norm(_errors(outcome)[:, :2], axis=1)
        steps = np.diff(outcome["true_pose"][:, :2], axis=0)
        values = {
            "steps": len(steps),
            "way_m": np.linalg.norm(steps, axis=1).sum(),
            "duration_s": outcome["stamps"][-1],
            "rms_m": np.sqrt(np.mean(place**2)),
            "largest_m": place.max(),
        }
        figures |= named(f"trajectory.{world}", values)
    return figures


def trajectory_section(outcomes: Outcomes) -> Section:
    """The paper's four figures."""
    normal, over_range = (outcomes[f"trajectory-{WORLDS[w]}"] for w in ("normal", "over_range"))
    return Section(
        "The paper's two runs",
        [
            Paragraph(
                "One loop through the paper's way-points: {trajectory.normal.steps:.0f} steps, "
                "{trajectory.normal.duration_s:.1f} s, {trajectory.normal.way_m:.0f} m. What is "
                "there is red, what the filter says blue, as in the paper; a dot is an end that "
                "the filter takes for one, an arrowhead an end beyond which the line may go on. "
                "The paper prints no numbers of its errors but draws them."
            ),
            _map(normal, "yan-normal", "The paper's fig. 6: the normal run."),
            _error_picture(
                normal,
                "The paper's fig. 7: errors of the normal run, "
                "{trajectory.normal.rms_m:.2f} m root mean square and "
                "{trajectory.normal.largest_m:.2f} m at most.",
            ),
            _map(over_range, "yan-over-range", "The paper's fig. 8: the third line is longer than "
                 "can be seen. The map ends where the sight did."),
            _error_picture(
                over_range,
                "The paper's fig. 9: errors of the over-range run, "
                "{trajectory.over_range.rms_m:.2f} m root mean square and "
                "{trajectory.over_range.largest_m:.2f} m at most.",
            ),
        ],
    )  # fmt: skip


def _errors(outcome: Outcome) -> Array:
    error = outcome["pose"] - outcome["true_pose"]
    error[:, 2] = wrap(error[:, 2])
    return np.asarray(error)


def _map(outcome: Outcome, name: str, caption: str) -> Picture:
    figure, axes = new_figure(8.5, 6.4)
    area = axes[0, 0]
    world = make_plane_world(name)
    for index, segment in enumerate(world.segments):
        ends = segment.reshape(2, 2)
        area.plot(*ends.T, color=_TRUE, lw=4, alpha=0.45, label="lines" if index == 0 else None)
        area.annotate(str(index + 1), ends.mean(axis=0), color=_TRUE, xytext=(6, 6),
                      textcoords="offset points")  # fmt: skip
    area.plot(*world.waypoints.T, "x", color="k", ms=6, label="way-points")
    way = compose(world.start, outcome["true_pose"])
    area.plot(*way[:, :2].T, color=_TRUE, lw=3, alpha=0.45, label="true way")
    found = compose(world.start, outcome["pose"])
    area.plot(*found[:, :2].T, color=_FOUND, lw=1.1, label="way and lines of the filter")
    for ends, opened in zip(outcome["ends"], outcome["open"], strict=True):
        area.plot(*ends.T, color=_FOUND, lw=1.3)
        for end, other, is_open in zip(ends, ends[::-1], opened, strict=True):
            _end_mark(area, end, other, is_open=bool(is_open))
    area.set_aspect("equal", adjustable="datalim")
    finish(area, x="x [m]", y="y [m]", legend=True)
    return Picture(caption, figure)


def _end_mark(area: Any, end: Array, other: Array, *, is_open: bool) -> None:
    if not is_open:
        area.plot(*end, ".", color=_FOUND, ms=7)
        return
    along = (end - other) / np.linalg.norm(end - other)
    area.annotate("", end + 2.5 * along, end,
                  arrowprops={"arrowstyle": "->", "color": _FOUND})  # fmt: skip


def _error_picture(outcome: Outcome, caption: str) -> Picture:
    figure, axes = new_figure(11, 2.7, 1, 3)
    errors = _errors(outcome)
    for k, (axis, unit, scale) in enumerate(_AXES):
        area = axes[0, k]
        band = 2 * scale * outcome["sigma"][:, k]
        area.fill_between(outcome["stamps"], -band, band, color=_FOUND, alpha=0.15, lw=0)
        area.plot(outcome["stamps"], scale * errors[:, k], color=_FOUND, lw=1)
        finish(area, x="time [s]", y=f"error of {axis} [{unit}]")
    return Picture(f"{caption} Shaded: two standard deviations, as the filter believes.", figure)
