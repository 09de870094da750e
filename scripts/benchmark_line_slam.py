"""How fast lines are seen: paper 2's observers against each other, and lines in lidar scans."""

from functools import partial

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from grouser.envs.sensors.line_observer import (
    BisectionObserver,
    ClosedFormObserver,
    LineObserver,
    PointByPointObserver,
)
from grouser.estimators.line_slam.extraction import LineExtractor
from grouser.geometry import Array
from grouser.rig import Rig
from grouser.scripts.benchmark_timing import (
    Figures,
    Measurement,
    curves,
    median_seconds,
    seconds,
)

_REACH = 30.0  # m, as in the paper
_SEGMENTS = np.array(
    [
        [-30.0, 10.0, 0.0, 30.0],
        [0.0, 20.0, 20.0, 0.0],
        [0.0, -35.0, 45.0, 0.0],
        [-60.0, 7.0, 0.0, -35.0],
    ]
)
"""(4, 4) m: the paper's landmarks."""
_WAYPOINTS = np.array(
    [[0.0, 35.0], [25.0, 0.0], [0.0, -20.0], [-35.0, 0.0], [-35.0, 10.0], [0.0, 35.0]]
)
"""m: the paper's way."""
_ROUNDS = 15


def observers() -> Figures:
    """All see the paper's landmarks from the same places along its way, in turns."""
    contestants: dict[str, LineObserver] = {
        "bisection": BisectionObserver(tolerance=1e-3),
        "closed": ClosedFormObserver(),
        "points": PointByPointObserver(spacing=0.1),
    }
    segments, position = _seen_from_everywhere()
    times: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(_ROUNDS + 1):
        for name, observer in contestants.items():
            look = partial(observer.observe, segments, position, _REACH)
            times[name].append(seconds(look))
    bisection, closed, points = (np.median(taken[1:]) for taken in times.values())
    return {
        "line_slam.bisection_over_points": (float(points / bisection), "ratio"),
        "line_slam.closed_over_bisection": (float(bisection / closed), "ratio"),
    }


def many_segments() -> Figures:
    """The closed form on 1e5 random segments at once."""
    ends = np.random.default_rng(0).uniform(-60, 60, (100_000, 4))
    look = partial(ClosedFormObserver().observe, ends, (0.0, 0.0), _REACH)
    return {"line_slam.closed_1e5_ms": (1e3 * median_seconds(look, _ROUNDS), "ms")}


def extraction() -> Figures:
    """Lines in 360 beams: the robot's scans in a furnished room, each once a round."""
    rig, scans = _scans_in_a_room()
    assert rig.lidar is not None
    extractor = LineExtractor(rig.lidar)

    def extract_all() -> None:
        for scan in scans:
            extractor.extract(scan)

    took = median_seconds(extract_all, _ROUNDS) / len(scans)
    return {"line_slam.extraction_360_ms": (1e3 * took, "ms")}


MEASUREMENTS = (
    Measurement(observers, ("line_slam.bisection_over_points", "line_slam.closed_over_bisection")),
    Measurement(many_segments, ("line_slam.closed_1e5_ms",)),
    Measurement(extraction, ("line_slam.extraction_360_ms",)),
)


def _seen_from_everywhere() -> tuple[Array, Array]:
    """The landmarks as they lie around a robot at every metre of its way: (n, 4), from (2,)."""
    legs = list(zip(_WAYPOINTS[:-1], _WAYPOINTS[1:], strict=True))
    steps = [max(2, int(np.linalg.norm(end - start))) for start, end in legs]
    way = np.vstack(
        [np.linspace(start, end, n) for (start, end), n in zip(legs, steps, strict=True)]
    )
    around = _SEGMENTS[None] - np.tile(way, 2)[:, None]
    return around.reshape(-1, 4), np.zeros(2)


def _scans_in_a_room() -> tuple[Rig, list[NDArray[np.float32]]]:
    env = gym.make("grouser/TrackedRobot-v0", world="room", sensors=("lidar",), dynamics="fast")
    observation, _ = env.reset(seed=0)
    scans = [observation["lidar"].copy()]
    for action in curves():
        observation, *_ = env.step(action)
        scans.append(observation["lidar"].copy())
    rig: Rig = env.get_wrapper_attr("rig")
    env.close()
    return rig, scans
