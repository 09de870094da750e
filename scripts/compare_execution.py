"""The work of a comparison: every missing run is done and kept, one rollout after another."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from grouser.agents.scripted import DRIVES
from grouser.agents.waypoints import waypoint_misses
from grouser.estimators import registry
from grouser.estimators.base import PoseEstimator
from grouser.estimators.evaluation.comparison import (
    OnStep,
    OpenLoop,
    compare_closed_loop,
    compare_open_loop,
)
from grouser.estimators.evaluation.results import ResultsFolder
from grouser.estimators.evaluation.summary import summarise
from grouser.geometry import Array
from grouser.rig import Rig
from grouser.scripts.compare_source import Env
from grouser.scripts.compare_tour import tour, waypoint_driver

TOUR, WAYPOINTS = "tour", "waypoints"
PLANNED = (TOUR, WAYPOINTS)
"""Drivers that look at the world before they begin."""
DRIVERS = (*DRIVES, TOUR, WAYPOINTS)


@dataclass(frozen=True, slots=True)
class Plan:
    """A comparison that was found to be possible."""

    env: Env
    source: str
    estimators: Sequence[str]
    driver: str | None
    """One of DRIVERS; None where actions have no effect."""
    seeds: int
    steps: int
    folder: ResultsFolder
    reference_sigmas: Array | None = None
    """(3,) of true poses that are but a reference: see `summarise`."""
    scout: Env | None = None
    """The same world without sensors, for drivers of PLANNED; None for the others."""

    def close(self) -> None:
        """Free the environments."""
        self.env.close()
        if self.scout is not None:
            self.scout.close()

    @property
    def rig(self) -> Rig:
        rig = self.env.get_wrapper_attr("rig")
        assert isinstance(rig, Rig)
        return rig

    def missing(self, seed: int) -> list[str]:
        """Estimators whose run with that seed is not in the folder yet."""
        return [name for name in self.estimators if not self.folder.has(name, seed)]

    @property
    def total_steps(self) -> int:
        """Steps of the environment that are still to be taken, at most."""
        missing = [len(self.missing(seed)) for seed in range(self.seeds)]
        rollouts = missing if self.driver == WAYPOINTS else [min(n, 1) for n in missing]
        return self.steps * sum(rollouts)


OnRollout = Callable[[str], None]
"""Called with a few words before each rollout."""


def execute(plan: Plan, on_rollout: OnRollout, on_step: OnStep) -> None:
    """Do the missing runs; each is on disk before the next rollout begins."""
    work = _closed_loop if plan.driver == WAYPOINTS else _open_loop
    for seed in range(plan.seeds):
        missing = plan.missing(seed)
        if missing:
            work(plan, missing, seed, on_rollout, on_step)


def _open_loop(
    plan: Plan, names: list[str], seed: int, on_rollout: OnRollout, on_step: OnStep
) -> None:
    on_rollout(f"seed {seed}")
    runs = compare_open_loop(
        plan.env,
        {name: _make(plan, name) for name in names},
        _drive(plan, seed),
        seed=seed,
        steps=plan.steps,
        on_step=on_step,
    )
    for run in runs:
        told = summarise(run, plan.source, reference_sigmas=plan.reference_sigmas)
        plan.folder.add(run, told)


def _closed_loop(
    plan: Plan, names: list[str], seed: int, on_rollout: OnRollout, on_step: OnStep
) -> None:
    for name in names:
        on_rollout(f"seed {seed}, {name}")
        assert plan.scout is not None
        driver = waypoint_driver(plan.scout, seed)
        run = compare_closed_loop(
            plan.env,
            name,
            _make(plan, name),
            driver,
            seed=seed,
            steps=plan.steps,
            on_step=on_step,
        )
        assert run.true_poses is not None
        misses = waypoint_misses(driver.waypoints, run.true_poses, driver.targets)
        plan.folder.add(run, summarise(run, plan.source) | {"waypoint_misses_m": misses})


def _make(plan: Plan, name: str) -> PoseEstimator:
    return registry.make(name, plan.rig)


def _drive(plan: Plan, seed: int) -> OpenLoop:
    if plan.driver is None:
        return lambda step: np.zeros(2)
    if plan.driver == TOUR:
        assert plan.scout is not None
        return tour(plan.scout, seed, plan.steps)
    return DRIVES[plan.driver](plan.rig)
