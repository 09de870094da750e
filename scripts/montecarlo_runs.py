"""Runs of the Monte Carlo: every method on the same drives, scored against their truth."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from grouser.estimators import make
from grouser.estimators.base import PoseEstimate, PoseEstimator, Status
from grouser.estimators.evaluation.consistency import nees
from grouser.estimators.visual.matching import MatchingOptions
from grouser.estimators.visual.odometry import VisualOdometry
from grouser.estimators.visual.point_frontend import PointFrontend, eyes_noise
from grouser.estimators.visual.solvers import SOLVERS
from grouser.geometry import Array, between
from grouser.rig import Rig
from grouser.scripts.montecarlo_scenarios import SCENARIOS
from grouser.scripts.montecarlo_score import Score
from grouser.scripts.montecarlo_world import Run, WorldOptions, drive
from grouser.scripts.sweep import in_order, sweep

TRACKS_ONLY = "dead-reckoning"
RECOMMENDED = "one-point"
_EVERY = 10  # frames between those whose NEES is taken


@dataclass(frozen=True, slots=True)
class Method:
    """An estimator with its options; but for them, its defaults."""

    words: str
    options: Mapping[str, Any] = field(default_factory=dict)


METHODS: dict[str, Method] = {
    TRACKS_ONLY: Method("the tracks alone"),
    "one-point-frames": Method(
        "frame to frame, no tracks", {"frame_to_frame": True, "use_tracks": False}
    ),
    "one-point-frames-tracks": Method("frame to frame", {"frame_to_frame": True}),
    "one-point-keyframes": Method("keyframes, no tracks", {"use_tracks": False}),
    RECOMMENDED: Method("keyframes and tracks"),
    **{
        name: Method("keyframes and tracks", {"solver": name})
        for name in SOLVERS
        if name != RECOMMENDED
    },
}
"""By name: the one-point estimator's forms, and every other solver in its recommended form."""


def run_all(
    scenarios: Sequence[str],
    methods: Sequence[str],
    seeds: int,
    *,
    processes: int = 2,
    ray: str | None = None,
    world: WorldOptions | None = None,
) -> Iterator[list[Score]]:
    """The scores of every drive, one list a drive; in an order that does not depend on timing."""
    drives = [
        (scenario, seed, tuple(methods), world or WorldOptions())
        for scenario in scenarios
        for seed in range(seeds)
    ]
    yield from in_order(sweep(_score_drive, drives, processes=processes, ray=ray))


def _score_drive(drive: tuple[str, int, Sequence[str], WorldOptions]) -> list[Score]:
    return score_drive(*drive)


def score_drive(
    scenario: str, seed: int, methods: Sequence[str], world: WorldOptions
) -> list[Score]:
    """Every method on one drive."""
    chosen = SCENARIOS[scenario]
    number = list(SCENARIOS).index(scenario)
    run = drive(chosen.motion(), chosen.camera, world, np.random.default_rng([seed, number]))
    return [_score(scenario, method, seed, run, world) for method in methods]


def make_method(name: str, rig: Rig, world: WorldOptions) -> PoseEstimator:
    """The estimator, with its own defaults and the front end for points."""
    if name == TRACKS_ONLY:
        return make(TRACKS_ONLY, rig)
    assert rig.stereo is not None
    frontend = PointFrontend(
        rig.stereo, noise=eyes_noise(world.noise_px), matching=MatchingOptions()
    )
    return VisualOdometry(rig, frontend=frontend, **METHODS[name].options)


def _score(scenario: str, method: str, seed: int, run: Run, world: WorldOptions) -> Score:
    estimates, times = estimate(make_method(method, run.rig, world), run, seed)
    poses = np.array([e.pose for e in estimates])
    covariances = np.array([e.covariance for e in estimates])
    last = between(run.truth[-1], poses[-1])
    off = np.linalg.norm(poses[:, :2] - run.truth[:, :2], axis=1)
    scored = slice(_EVERY, None, _EVERY)
    tracking = np.mean([e.status == Status.TRACKING for e in estimates])
    return Score(
        scenario,
        method,
        seed,
        mm=1e3 * float(np.linalg.norm(last[:2])),
        degrees=float(np.degrees(abs(last[2]))),
        rms_mm=1e3 * float(np.sqrt(np.mean(off**2))),
        nees=float(nees(run.truth[scored], poses[scored], covariances[scored]).mean()),
        tracking=float(tracking),
        ms=1e3 * float(np.median(times)),
    )


def estimate(estimator: PoseEstimator, run: Run, seed: int) -> tuple[list[PoseEstimate], Array]:
    """The estimates of a drive's frames, and the processor time [s] that each update took."""
    first = estimator.reset(run.observations[0], rng=np.random.default_rng(seed))
    estimates, times = [first], []
    for observation in run.observations[1:]:
        started = time.thread_time()
        estimates.append(estimator.update(observation))
        times.append(time.thread_time() - started)
    return estimates, np.array(times)
