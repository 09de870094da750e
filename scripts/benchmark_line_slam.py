"""How fast lines are seen and mapped: paper 2's observers against each other, lines in lidar scans,
and a step of the filter in maps of many lines."""

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
from grouser.estimators.line_slam.ackermann import AckermannPredictor
from grouser.estimators.line_slam.ekf import LineEkf, LineEkfOptions
from grouser.estimators.line_slam.extraction import LineExtractor
from grouser.estimators.line_slam.linearization import AtTheEstimate
from grouser.estimators.line_slam.lines import normals, points_on, tangents
from grouser.estimators.line_slam.map import LineMap
from grouser.estimators.line_slam.measurements import LineMeasurements
from grouser.estimators.line_slam.motion import PredictedMotion
from grouser.estimators.line_slam.state import LineState
from grouser.estimators.line_slam.unevenness import Unevenness
from grouser.geometry import Array
from grouser.rig import Rig
from grouser.rig_motion import Steering
from grouser.scripts.benchmark_timing import (
    Figures,
    Measurement,
    curves,
    least_seconds,
    median_seconds,
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
_ROUNDS, _TURNS = 15, 300
_STEPS = 60
_STEERING = Steering(
    wheelbase=1.0,
    max_speed=1.0,
    max_angle=0.5,
    max_angle_rate=1.0,
    sigma_speed=0.05,
    sigma_angle=0.02,
)


def observers() -> Figures:
    """All see the paper's landmarks from the same places along its way, in turns."""
    contestants: dict[str, LineObserver] = {
        "bisection": BisectionObserver(tolerance=1e-3),
        "closed": ClosedFormObserver(),
        "points": PointByPointObserver(spacing=0.1),
    }
    segments, position = _seen_from_everywhere()
    took = least_seconds(
        {
            name: partial(observer.observe, segments, position, _REACH)
            for name, observer in contestants.items()
        },
        _TURNS,
    )
    return {
        "line_slam.bisection_over_points": (took["points"] / took["bisection"], "ratio"),
        "line_slam.closed_over_bisection": (took["bisection"] / took["closed"], "ratio"),
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


def updates() -> Figures:
    """A step of the filter that sees the four walls of one of many rooms, on one core."""
    return {
        f"line_slam.update_n{lines}_ms": (1e3 * _step_seconds(lines), "ms") for lines in (100, 1000)
    }


MEASUREMENTS = (
    Measurement(observers, ("line_slam.bisection_over_points", "line_slam.closed_over_bisection")),
    Measurement(many_segments, ("line_slam.closed_1e5_ms",)),
    Measurement(extraction, ("line_slam.extraction_360_ms",)),
    Measurement(updates, ("line_slam.update_n100_ms", "line_slam.update_n1000_ms")),
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


def _step_seconds(lines: int) -> float:
    """s, of a filter that stands in the first of many rooms, in a map of so many lines."""
    motion = PredictedMotion(AckermannPredictor(_STEERING, dt=0.1))
    slam = LineEkf(
        LineState(np.zeros(3), motion.errors.sigmas),
        motion,
        AtTheEstimate(),
        Unevenness(0.0),
        LineEkfOptions(),
    )
    rooms = _rooms(lines)
    slam.know(rooms)
    slam.state.buffer[:3, :3] = np.diag([0.05, 0.05, 0.01]) ** 2
    seen = _walls_of_the_first(rooms)
    observation = {"steering": np.array([0.01, 0.0])}
    told = slam.step(observation, lambda _: seen)
    if told.matched != len(seen):
        raise RuntimeError(f"of {len(seen)} walls the filter took {told.matched} for its own")
    return median_seconds(lambda: slam.step(observation, lambda _: seen), _STEPS)


def _rooms(lines: int) -> LineMap:
    """Four walls a room, one room after another along x; all known together, each by itself."""
    room = np.array([[4.0, 0.0], [4.0, np.pi / 2], [4.0, np.pi], [4.0, -np.pi / 2]])
    walls = np.tile(room, (lines // 4, 1))
    shift = np.repeat(10.0 * np.arange(lines // 4), 4)
    n = normals(walls[:, 1])
    walls[:, 0] += n[:, 0] * shift
    middles = tangents(walls[:, 1])[:, 0] * shift
    # Errors of the frame shift and turn all rooms: r by n . s, alpha by the turn.
    together = np.zeros((2 * lines, 3))
    together[0::2, :2], together[1::2, 2] = n, 1.0
    covariance = together @ np.diag([0.05, 0.05, 0.01]) ** 2 @ together.T
    covariance += np.diag(np.tile([0.02**2, 0.005**2], lines))
    extents = middles[:, None] + [-4.0, 4.0]
    return LineMap(
        walls,
        covariance,
        extents,
        open_ends=np.zeros((lines, 2), dtype=np.bool_),
        counts=np.full(lines, 5, dtype=np.int64),
    )


def _walls_of_the_first(rooms: LineMap) -> LineMeasurements:
    return LineMeasurements(
        rooms.lines[:4].copy(),
        np.tile(np.diag([0.02, 0.004]) ** 2, (4, 1, 1)),
        points_on(rooms.lines[:4, None], rooms.extents[:4]),
        np.full((4, 2), 0.05),
        np.zeros((4, 2), dtype=np.bool_),
    )


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
