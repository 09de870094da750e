"""One simulated drive that feeds all estimators at once, and what is kept of it."""

from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from grouser.estimators import registry
from grouser.estimators.base import PoseEstimator, Status
from grouser.estimators.evaluation.comparison import Run, compare_open_loop
from grouser.geometry import Array
from grouser.rig import Rig
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome
from grouser.scripts.reproduction.zhao.contenders import sensors_for
from grouser.scripts.reproduction.zhao.course import Course, plan

_KEPT = {"twist": "true_twist", "icr": "icr", "effective_width": "effective_width"}
"""What is kept of `info`, and what it is called there."""


@dataclass(frozen=True, slots=True)
class Subject:
    """An estimator under test."""

    label: str
    estimator: str
    """Its registered name."""
    ignores_offset: bool = False
    """Whether it takes the camera to be above the track centre, where it is not."""
    options: tuple[tuple[str, Any], ...] = ()
    """Beyond those that its name stands for."""

    def make(self, rig: Rig) -> PoseEstimator:
        """The estimator for a robot."""
        known = without_offset(rig) if self.ignores_offset else rig
        return registry.make(self.estimator, known, **dict(self.options))


def subjects(names: tuple[str, ...]) -> tuple[Subject, ...]:
    """The estimators as they are, labelled by their names."""
    return tuple(Subject(name, name) for name in names)


def without_offset(rig: Rig) -> Rig:
    """The rig of a robot whose camera is above the track centre, turned and as high as it is."""
    assert rig.stereo is not None
    mount = rig.stereo.T_base_camera.copy()
    mount[:2, 3] = 0.0
    return rig.with_overrides({"stereo.T_base_camera": mount})


@dataclass(frozen=True, slots=True)
class CourseExperiment(Experiment):
    """Drive a course and let all subjects look on."""

    course: Course
    subjects: tuple[Subject, ...]

    @property
    def name(self) -> str:
        return self.course.name

    @property
    def parts(self) -> int:
        return self.course.frames

    def run(self, on_part: OnPart) -> Outcome:
        """Stamps, true poses and twists, and every subject's poses, variances, statuses, times."""
        planned = plan(self.course)
        recorder = Recorder(self._environment())
        try:
            runs = compare_open_loop(
                recorder,
                {subject.label: subject.make(recorder.rig) for subject in self.subjects},
                lambda step: planned.actions[step],
                seed=planned.seed,
                steps=self.course.frames,
                on_step=on_part,
            )
        finally:
            recorder.close()
        return recorder.record() | {"seed": np.array(planned.seed)} | _kept(runs)

    def _environment(self) -> gym.Env[Any, Any]:
        return self.course.make(sensors_for([subject.estimator for subject in self.subjects]))


class Recorder(gym.Wrapper[Any, Any, Any, Any]):
    """Keeps what the robot truly did, which estimators must not see."""

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        super().__init__(env)
        self._record: dict[str, list[Array]] = {key: [] for key in _KEPT}

    @property
    def rig(self) -> Rig:
        rig = self.env.get_wrapper_attr("rig")
        assert isinstance(rig, Rig)
        return rig

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step, and take note; a course was planned so that nothing is struck.

        Raises:
            RuntimeError: something was struck.
        """
        observation, reward, terminated, truncated, info = self.env.step(action)
        if info["collision"]:
            raise RuntimeError("the robot struck something on a course that was free")
        for key, told in _KEPT.items():
            self._record[key].append(np.array(info[told]))
        return observation, reward, terminated, truncated, info

    def record(self) -> dict[str, Array]:
        """`twist` (n, 3) m/s, m/s, rad/s; `icr` (n, 3) m; `effective_width` (n,) m."""
        return {key: np.array(values) for key, values in self._record.items()}


def _kept(runs: list[Run]) -> dict[str, Array]:
    true_poses = runs[0].true_poses
    assert true_poses is not None
    kept: dict[str, Array] = {"stamps": runs[0].stamps, "true_pose": true_poses}
    for run in runs:
        estimates = run.estimates
        of_run = {
            "pose": np.array([e.pose for e in estimates]),
            "covariance": np.array([e.covariance for e in estimates]),
            "tracking": np.array([e.status is Status.TRACKING for e in estimates]),
            "ms": run.update_ms,
            "matches": np.array([e.diagnostics.get("matches", np.nan) for e in estimates]),
            "inliers": np.array([e.diagnostics.get("inliers", np.nan) for e in estimates]),
        }
        kept |= {f"{run.estimator}.{key}": values for key, values in of_run.items()}
    return kept
