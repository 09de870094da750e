"""How long visual odometry takes for a stereo pair, and where the time goes."""

import time
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.agents.scripted import figure_eight
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.estimators import make
from grouser.estimators.base import readable
from grouser.rig import Rig
from grouser.scripts.benchmark_timing import Figures, Measurement

_SEED = 0
_FRAMES = 200
_WARM_UP = 10  # kernels load and the corner thresholds settle
_ESTIMATION = ("ms_ransac", "ms_refinement", "ms_filter")
_STAGES = ("ms_stereo", "ms_matching", *_ESTIMATION)


def odometry() -> Figures:
    """The whole one-point pipeline on a drive of the simulated robot at 320 x 240, on one core."""
    rig, observations = _drive()
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        times, stages = _run(rig, observations)
    finally:
        cv2.setNumThreads(threads)
    estimation = sum(stages[stage] for stage in _ESTIMATION)
    figures = {
        "odometry.pair_320x240_ms": (float(np.median(times)), "ms"),
        "odometry.pair_320x240_p95_ms": (float(np.percentile(times, 95)), "ms"),
        "odometry.estimation_ms": (float(np.median(estimation)), "ms"),
    }
    for stage in _STAGES:
        name = f"odometry.{stage.removeprefix('ms_')}_ms"
        figures[name] = (float(np.median(stages[stage])), "ms")
    return figures


MEASUREMENTS = (
    Measurement(
        odometry,
        (
            "odometry.pair_320x240_ms",
            "odometry.pair_320x240_p95_ms",
            "odometry.estimation_ms",
            *(f"odometry.{stage.removeprefix('ms_')}_ms" for stage in _STAGES),
        ),
    ),
)


def _drive() -> tuple[Rig, list[dict[str, NDArray[Any]]]]:
    """What the robot sees on a figure-eight."""
    env = TrackedRobotEnv(sensors=["left", "right", "tracks"])
    drive = figure_eight(env.rig)
    observation, _ = env.reset(seed=_SEED)
    observations = [observation]
    for step in range(_FRAMES):
        observations.append(env.step(drive(step).astype(np.float32))[0])
    env.close()
    return env.rig, observations


def _run(
    rig: Rig, observations: list[dict[str, NDArray[Any]]]
) -> tuple[list[float], dict[str, NDArray[np.float64]]]:
    """Milliseconds of every update, and of each stage in it."""
    estimator = make("one-point-ransac", rig)
    seen = [readable(estimator, observation, {}) for observation in observations]
    estimator.reset(seen[0], rng=np.random.default_rng(_SEED))
    times, diagnostics = [], []
    for observation in seen[1:]:
        started = time.perf_counter()
        estimate = estimator.update(observation)
        times.append(1e3 * (time.perf_counter() - started))
        diagnostics.append(estimate.diagnostics)
    kept = diagnostics[_WARM_UP:]
    stages = {stage: np.array([frame[stage] for frame in kept]) for stage in _STAGES}
    return times[_WARM_UP:], stages
