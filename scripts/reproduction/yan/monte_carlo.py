"""Many drives through the same course, with noise of their own, watched by every form."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grouser.envs.plane.world import make_plane_world
from grouser.estimators.base import PoseEstimator
from grouser.estimators.evaluation.comparison import Run
from grouser.estimators.evaluation.consistency import nees
from grouser.estimators.line_slam.map import LineMapper
from grouser.geometry import Array, compose, wrap
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome, Outcomes
from grouser.scripts.reproduction.yan.associations import Associations
from grouser.scripts.reproduction.yan.drives import line_world, rig_of, watch
from grouser.scripts.reproduction.yan.forms import Form, make_form
from grouser.scripts.reproduction.yan.honesty import plane_nees
from grouser.scripts.reproduction.yan.maps import map_errors, true_lines
from grouser.scripts.reproduction.yan.paper import OBSERVING_EVERY

_BLOCK = 5
_STARTS = 1
"""Sets the draws of the start apart from those of the drive."""


@dataclass(frozen=True, slots=True)
class MonteCarlo(Experiment):
    """A block of drives, and forms that look on; how well the heading of the start is known."""

    label: str
    world: str
    forms: Mapping[str, Form]
    seeds: tuple[int, ...]
    start_sigma: float = 0.0
    """rad: the filters are told it, and the start is turned by so much at random."""

    @property
    def name(self) -> str:
        return f"{self.label}-{self.seeds[0]}"

    @property
    def parts(self) -> int:
        return len(self.seeds)

    def run(self, on_part: OnPart) -> Outcome:
        """`FORM.FIGURE` (seeds, looks) or (seeds,), as `_over_time`, `_in_all` and
        `_of_map` have them."""
        kept: dict[str, list[Array | float]] = {}
        for seed in self.seeds:
            for name, values in self._drive(seed).items():
                for figure, value in values.items():
                    kept.setdefault(f"{name}.{figure}", []).append(value)
            on_part()
        return {name: np.array(values) for name, values in kept.items()}

    def _drive(self, seed: int) -> dict[str, dict[str, Array | float]]:
        """What every form made of one drive."""
        turn = self.start_sigma * np.random.default_rng([seed, _STARTS]).standard_normal()
        start = np.array([0.0, 0.0, turn])
        values: dict[str, dict[str, Array | float]] = {}
        for name, (run, estimator, looks) in self._watched(seed).items():
            assert run.true_poses is not None
            truth = compose(start, run.true_poses)
            values[name] = _over_time(run, truth) | _in_all(run, truth)
            if isinstance(estimator, LineMapper) and not self.start_sigma:
                values[name] |= self._of_map(estimator)
            if name in looks and not self.start_sigma:
                values[name] |= self._of_associations(looks, name, truth)
        return values

    def _watched(self, seed: int) -> dict[str, tuple[Run, PoseEstimator, Associations]]:
        """Each with the estimator as it was left, and what it took lines for. One environment for
        each kind of sight: the steering's noise is the same in all."""
        known = {"start_sigma": (0.0, 0.0, self.start_sigma)} if self.start_sigma else {}
        watched: dict[str, tuple[Run, PoseEstimator, Associations]] = {}
        for sight in dict.fromkeys((form.sees, form.noise) for form in self.forms.values()):
            sees, noise = sight
            sensors = ("steering",) if sees is None else ("steering", sees)
            env = line_world(self.world, sensors=sensors, noise=dict(noise))
            estimators = {
                name: make_form(form, rig_of(env), **known)
                for name, form in self.forms.items()
                if (form.sees, form.noise) == sight
            }
            looks = Associations(estimators)
            for run in watch(env, self.world, estimators, seed, on_step=looks.note):
                watched[run.estimator] = run, estimators[run.estimator], looks
        return watched

    def _of_map(self, mapper: LineMapper) -> dict[str, Array | float]:
        """Of a map whose frame is known, which is that of the start."""
        world = make_plane_world(self.world)
        errors = map_errors(mapper.map, world.segments_from_start, world.start)
        return {
            "line_r": errors.r,
            "line_alpha": errors.alpha,
            "third_end": errors.third_end,
        }

    def _of_associations(
        self, looks: Associations, name: str, truth: Array
    ) -> dict[str, Array | float]:
        """How many there were in a drive, and how many were wrong."""
        true = true_lines(make_plane_world(self.world).segments_from_start)
        associations, wrong = looks.counts(name, true, truth[1:])
        return {"associations": float(associations), "wrong": float(wrong)}


def blocks(
    label: str, world: str, forms: Mapping[str, Form], runs: int, start_sigma: float = 0.0
) -> list[MonteCarlo]:
    """So many drives, a few at a time: what is interrupted loses only those."""
    seeds = [tuple(range(at, min(at + _BLOCK, runs))) for at in range(0, runs, _BLOCK)]
    return [MonteCarlo(label, world, forms, of_block, start_sigma) for of_block in seeds]


def joined(outcomes: Outcomes, experiments: Sequence[MonteCarlo]) -> Outcomes:
    """The blocks' outcomes, by labels."""
    by_label: dict[str, list[Outcome]] = {}
    for experiment in experiments:
        by_label.setdefault(experiment.label, []).append(outcomes[experiment.name])
    return {
        label: {name: np.concatenate([block[name] for block in of_label]) for name in of_label[0]}
        for label, of_label in by_label.items()
    }


def _over_time(run: Run, truth: Array) -> dict[str, Array | float]:
    """(looks,) each: after every look of the sensor but that of the start."""
    looks = slice(OBSERVING_EVERY, None, OBSERVING_EVERY)
    estimates = run.estimates[looks]
    poses = np.array([e.pose for e in estimates])
    P = np.array([e.covariance for e in estimates])
    told = [e.diagnostics for e in estimates]
    matched = np.array([t.get("lines_matched", t.get("points_matched", 0.0)) for t in told])
    return {
        "stamps": run.stamps[looks],
        "nees": nees(truth[looks], poses, P),
        "plane_nees": plane_nees(truth[looks], poses, P),
        "matched": matched,
        "nis_sum": matched * np.nan_to_num([t.get("nis", np.nan) for t in told]),
        "heading_sigma": np.sqrt(P[:, 2, 2]),
    }


def _in_all(run: Run, truth: Array) -> dict[str, Array | float]:
    """One number each; errors at all steps but the first, m and rad."""
    poses = np.array([e.pose for e in run.estimates])[1:]
    error = poses - truth[1:]
    place, heading = np.linalg.norm(error[:, :2], axis=1), wrap(error[:, 2])
    told = run.estimates[-1].diagnostics
    return {
        "rms": float(np.sqrt(np.mean(place**2))),
        "heading_rms": float(np.sqrt(np.mean(heading**2))),
        "final": float(place[-1]),
        "landmarks": told.get("lines_in_map", told.get("points_in_map", np.nan)),
    }
