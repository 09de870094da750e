"""Table 1: how long simulations take whose sensor finds what is visible by this or that way.

The paper's times are those of an interpreted language (MATLAB). Here everything is timed twice: as
it is, compiled, and by the same code interpreted, with numba switched off in a process of its own.
"""

import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from multiprocessing import get_context

import numpy as np

from grouser.envs.plane.world import make_plane_world
from grouser.envs.sensors.line_observer import (
    BisectionObserver,
    ClosedFormObserver,
    LineObserver,
    PointByPointObserver,
)
from grouser.estimators.base import readable
from grouser.geometry import Array, compose
from grouser.scripts.reproduction.experiment import Experiment, OnPart, Outcome
from grouser.scripts.reproduction.yan.drives import course, line_world, rig_of
from grouser.scripts.reproduction.yan.forms import CORRECTED, FORMS, make_form
from grouser.scripts.reproduction.yan.paper import WORLDS

OBSERVERS: dict[str, Callable[[], LineObserver]] = {
    "bisection": BisectionObserver,
    "points_0_1": lambda: PointByPointObserver(spacing=0.1),
    "points_0_5": lambda: PointByPointObserver(spacing=0.5),
    "closed": ClosedFormObserver,
}
"""Bisection to a millimetre, point by point at two spacings [m], and the closed form."""

_OFF = "NUMBA_DISABLE_JIT"
_LOOKS, _LONG = 25, 0.5
"""Calls of an observer: so many, or fewer if they take longer than this in all [s]."""


@dataclass(frozen=True, slots=True)
class ObserverTimes(Experiment):
    """Every observer in both worlds: alone, and within the whole simulation."""

    rounds: int
    steps: int
    """Of a simulation, at most."""
    interpreted: bool = False

    @property
    def name(self) -> str:
        return "observer-times-interpreted" if self.interpreted else "observer-times"

    @property
    def parts(self) -> int:
        return self.rounds * len(WORLDS)

    @property
    def measures_time(self) -> bool:
        return True

    def run(self, on_part: OnPart) -> Outcome:
        """`WORLD.OBSERVER.alone_s` and `.whole_s`, (rounds,)."""
        taken: dict[str, list[float]] = {}
        with _calls(interpreted=self.interpreted) as call:
            if not self.interpreted:
                call(_round, next(iter(WORLDS.values())), self.steps)  # kernels load
            for (key, world), _ in product(WORLDS.items(), range(self.rounds)):
                for name, seconds in call(_round, world, self.steps).items():
                    taken.setdefault(f"{key}.{name}", []).append(seconds)
                on_part()
        return {name: np.array(values) for name, values in taken.items()}


Call = Callable[..., dict[str, float]]
"""Of a function and its arguments."""


@contextmanager
def _calls(*, interpreted: bool) -> Iterator[Call]:
    """Calls functions here, or where nothing is compiled."""
    if not interpreted:
        yield lambda function, *arguments: function(*arguments)
        return
    before = os.environ.get(_OFF)
    os.environ[_OFF] = "1"  # numba reads it when the new process imports it
    try:
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            yield lambda function, *arguments: pool.submit(function, *arguments).result()
    finally:
        os.environ.pop(_OFF)
        if before is not None:
            os.environ[_OFF] = before


def _round(world: str, steps: int) -> dict[str, float]:
    """s: each observer once, in turns, so that what slows the machine slows all."""
    taken = {}
    way = _way(world, steps)
    for name, make in OBSERVERS.items():
        taken[f"{name}.alone_s"] = _alone(make(), world, way)
        taken[f"{name}.whole_s"] = _whole(make(), world, steps)
    return taken


def _alone(observer: LineObserver, world: str, way: Array) -> float:
    """s to observe all lines from everywhere on the way, in one call: only the observer counts.
    The median of many calls, of which one that takes long needs but few."""
    segments = make_plane_world(world).segments
    around = (segments[None] - np.tile(way[:, None, :2], 2)).reshape(-1, 4)
    env = line_world(world)
    sensor = rig_of(env).line_sensor
    assert sensor is not None
    taken: list[float] = []
    while len(taken) < _LOOKS and sum(taken) < _LONG:
        began = time.perf_counter()
        observer.observe(around, (0.0, 0.0), sensor.range_max)
        taken.append(time.perf_counter() - began)
    return float(np.median(taken))


def _whole(observer: LineObserver, world: str, steps: int) -> float:
    """s of a whole simulation: vehicle, sensor at every step, and filter."""
    env = line_world(
        world, sensors=("steering", "lines"), observer=observer, observe_every=1
    ).unwrapped
    actions = course(world)[:steps]
    estimator = make_form(FORMS[CORRECTED], rig_of(env))
    began = time.perf_counter()
    observation, _ = env.reset(seed=0)
    estimator.reset(readable(estimator, observation, {}), rng=np.random.default_rng(0))
    for action in actions:
        observation, *_ = env.step(action)
        estimator.update(readable(estimator, observation, {}))
    return time.perf_counter() - began


def _way(world: str, steps: int) -> Array:
    """(N, 3) true poses in the world."""
    env = line_world(world, sensors=())
    _, info = env.reset(seed=0)
    poses = [info["true_pose"]]
    for action in course(world)[:steps]:
        *_, info = env.step(action)
        poses.append(info["true_pose"])
    return np.asarray(compose(make_plane_world(world).start, np.array(poses)))
