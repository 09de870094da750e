"""How long visual odometry takes for a stereo pair, where time goes, and how still it stands."""

import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.agents.scripted import Drive, figure_eight
from grouser.envs.tracked_robot import TrackedRobotEnv
from grouser.estimators import make
from grouser.estimators.base import readable
from grouser.rig import Rig
from grouser.scripts.benchmark_timing import Figures, Measurement

_SEED = 0
_FRAMES = 200
_WARM_UP = 10  # kernels load and the corner thresholds settle
_ESTIMATION = ("ms_ransac", "ms_refinement")  # the paper's "parameter estimation"
_STAGES = ("ms_stereo", "ms_matching", *_ESTIMATION, "ms_filter")
_SMALL, _LARGE, _STILL = (320, 240), (640, 480), (752, 480)
_STILL_FRAMES = 95


def odometry() -> Figures:
    """The whole one-point pipeline on a drive of the simulated robot at 320 x 240, on one core.

    Estimation is RANSAC and refinement; the filter has a figure of its own.
    """
    times, stages = _timed(_SMALL, _FRAMES)
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


def odometry_large() -> Figures:
    """The same at 640 x 480."""
    times, _ = _timed(_LARGE, _FRAMES // 2)
    return {"odometry.pair_640x480_ms": (float(np.median(times)), "ms")}


def standstill() -> Figures:
    """How far the pose wanders in 95 frames of 752 x 480 of a robot that stands still.

    Its cameras have their noise; the largest error of all frames, with tracks and without.
    """
    rig, observations = _watched(_STILL, _at_rest, _STILL_FRAMES)
    lengths, angles = [], []
    for use_tracks in (True, False):
        estimator = make("one-point-ransac", rig, use_tracks=use_tracks)
        estimator.reset(observations[0], rng=np.random.default_rng(_SEED))
        poses = np.array([estimator.update(shown).pose for shown in observations[1:]])
        lengths.append(np.hypot(poses[:, 0], poses[:, 1]).max())
        angles.append(np.abs(poses[:, 2]).max())
    return {
        "odometry.standstill_mm": (1e3 * float(max(lengths)), "mm"),
        "odometry.standstill_deg": (float(np.degrees(max(angles))), "deg"),
    }


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
    Measurement(odometry_large, ("odometry.pair_640x480_ms",)),
    Measurement(standstill, ("odometry.standstill_mm", "odometry.standstill_deg")),
)


def _timed(
    size: tuple[int, int], frames: int
) -> tuple[list[float], dict[str, NDArray[np.float64]]]:
    """Milliseconds of the updates on a figure-eight, and of their stages, on one core."""
    rig, observations = _watched(size, figure_eight, frames)
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        return _run(rig, observations)
    finally:
        cv2.setNumThreads(threads)


def _at_rest(rig: Rig) -> Drive:
    return lambda step: np.zeros(2)


def _watched(
    size: tuple[int, int], driver: Callable[[Rig], Drive], frames: int
) -> tuple[Rig, list[dict[str, NDArray[Any]]]]:
    """What the robot sees on a scripted drive."""
    env = TrackedRobotEnv(sensors=["left", "right", "tracks"], image_size=size)
    drive = driver(env.rig)
    observation, _ = env.reset(seed=_SEED)
    observations = [observation]
    for step in range(frames):
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
