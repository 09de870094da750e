"""What `grouser map` does with its options: prepare, drive, write, report."""

import math
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from grouser.envs.plane.world import PLANE_WORLDS
from grouser.estimators import registry
from grouser.estimators.base import PoseEstimator
from grouser.estimators.evaluation.comparison import OpenLoop, Run, compare_open_loop
from grouser.estimators.evaluation.folder import require_writable
from grouser.estimators.evaluation.plots import require_matplotlib
from grouser.estimators.evaluation.summary import covariances, planar, summarise
from grouser.estimators.line_slam.map import LineMapper
from grouser.estimators.line_slam.map_file import load_line_map, save_line_map
from grouser.estimators.line_slam.map_plot import Surroundings, draw_map
from grouser.geometry import lift
from grouser.kernels import announce
from grouser.scripts.compare_estimators import choose, sensors_for
from grouser.scripts.compare_source import Env, Log, Source, World
from grouser.scripts.compare_tour import tour
from grouser.scripts.map import Map
from grouser.scripts.plane_source import Plane
from grouser.scripts.scan_keeper import ScanKeeper
from grouser.scripts.terminal import progress
from grouser.scripts.usage import UsageError, usage_errors
from grouser.trajectory import Trajectory, write_tum

_DEFAULT_WORLD = "yan-normal"
_DPI = 120


@dataclass(frozen=True, slots=True)
class _Plan:
    """A drive that was found to be possible."""

    source: Source
    env: ScanKeeper
    estimator: PoseEstimator
    mapper: LineMapper
    """The same one."""
    steps: int
    folder: Path


def make_map(options: Map) -> int:
    """Drive, write the map, say how good it is, and return the exit code."""
    with usage_errors():
        plan = _prepare(options)
    try:
        run = _drive(options, plan)
        _write(options, plan, run)
    finally:
        plan.env.close()
    _report(options, plan, run)
    return 0


def _prepare(options: Map) -> _Plan:
    """Everything that can be refused is refused here, before any long work."""
    require_matplotlib(otherwise="")
    if not (math.isfinite(options.sigmas) and options.sigmas > 0):
        raise UsageError(f"--sigmas must be a positive number, got {options.sigmas}")
    if options.steps is not None and options.steps < 1:
        raise UsageError(f"--steps must be at least 1, got {options.steps}")
    source = _source(options)
    folder = options.output or _new_folder(source)
    require_writable(folder)
    gives = source.gives()
    names = choose([options.estimator], gives, source.label)
    env = ScanKeeper(source.make(sensors_for(names, gives)))
    estimator = _estimator(options, env)
    return _Plan(
        source,
        env,
        estimator,
        mapper=_mapper(options.estimator, estimator),
        steps=source.steps(options.steps),
        folder=folder,
    )


def _source(options: Map) -> Source:
    if options.log is not None:
        if options.world is not None or options.lidar:
            raise UsageError("--world and --lidar exclude --log: a recording has its own")
        return Log(options.log, {}, options.odometry_noise or 0.0)
    if options.odometry_noise is not None:
        raise UsageError("--odometry-noise is for the odometry of a recording and needs --log")
    name = options.world or _DEFAULT_WORLD
    if name in PLANE_WORLDS:
        return Plane(name, lidar=options.lidar)
    if options.lidar:
        raise UsageError(f"--lidar is for {' and '.join(PLANE_WORLDS)}; other worlds have one")
    return World(name)


def _new_folder(source: Source) -> Path:
    what = source.label.partition(":")[2]
    return Path("results") / f"map-{what}-{datetime.now():%Y%m%d-%H%M%S}"


def _estimator(options: Map, env: Env) -> PoseEstimator:
    given = dict(_option(words) for words in options.options)
    if options.map is not None:
        load_line_map(options.map)  # raises, and says what is wrong with the file
        given["map"] = str(options.map)
    try:
        return registry.make(options.estimator, env.get_wrapper_attr("rig"), **given)
    except TypeError as error:
        raise UsageError(f"{options.estimator}: {error}") from error


def _option(words: str) -> tuple[str, Any]:
    name, equals, value = words.partition("=")
    if not (equals and name.isidentifier()):
        raise UsageError(f"--options {words!r} is not NAME=VALUE, such as paper=true")
    return name, yaml.safe_load(value)


def _mapper(name: str, estimator: PoseEstimator) -> LineMapper:
    if not isinstance(estimator, LineMapper):
        makers = [
            n for n in registry.names() if issubclass(registry.estimator_class(n), LineMapper)
        ]
        raise UsageError(f"{name} makes no map of lines; these do: {', '.join(makers)}")
    return estimator


def _drive(options: Map, plan: _Plan) -> Run:
    announce()
    act = _actions(options, plan)
    with progress(plan.source.label, plan.steps) as bar:
        (run,) = compare_open_loop(
            plan.env,
            {options.estimator: plan.estimator},
            act,
            seed=options.seed,
            steps=plan.steps,
            on_step=bar.advance,
        )
    return run


def _actions(options: Map, plan: _Plan) -> OpenLoop:
    source = plan.source
    if isinstance(source, Plane):
        return source.drive(plan.steps)
    if not source.drivable:
        return lambda step: np.zeros(2)
    scout = source.make(())
    try:
        return tour(scout, options.seed, plan.steps)
    finally:
        scout.close()


def _write(options: Map, plan: _Plan, run: Run) -> None:
    plan.folder.mkdir(parents=True, exist_ok=True)
    line_map = plan.mapper.map
    save_line_map(plan.folder / "map.geojson", line_map)
    title = f"{options.estimator}, {plan.source.label}, seed {options.seed}"
    figure = draw_map(line_map, _surroundings(plan, run), sigmas=options.sigmas, title=title)
    figure.savefig(plan.folder / "map.png", dpi=_DPI)
    poses = Trajectory(run.stamps, lift(planar(run)), covariances(run))
    write_tum(plan.folder / "poses.tum", poses)
    if run.true_poses is not None:
        write_tum(plan.folder / "truth.tum", Trajectory(run.stamps, lift(run.true_poses)))


def _surroundings(plan: _Plan, run: Run) -> Surroundings:
    """What is truly there: the segments of a plane, or what the lidar hit."""
    source, estimated = plan.source, planar(run)
    known = run.true_poses is not None
    return Surroundings(
        way=estimated,
        true_way=run.true_poses if run.true_poses is not None else np.zeros((0, 3)),
        segments=source.segments if isinstance(source, Plane) else np.zeros((0, 4)),
        points=plan.env.points(run.true_poses if run.true_poses is not None else estimated),
        points_from=f"scans from the {'true' if known else 'estimated'} poses",
    )


def _report(options: Map, plan: _Plan, run: Run) -> None:
    line_map, figures = plan.mapper.map, summarise(run, plan.source.label)
    done = "the way by" if options.map is not None else "a map of"
    print(f"{options.estimator} on {plan.source.label}: {done} {len(line_map)} lines")
    if figures["ate_m"] is not None:
        print(
            f"  {figures['distance_m']:.1f} m driven, ATE {figures['ate_m']:.3f} m, "
            f"{figures['final_error_m']:.3f} m off at the end, NEES {figures['nees_mean']:.2f}"
        )
    print(f"  {figures['ms_per_frame_median']:.2f} ms a frame (median)")
    truth = ", truth.tum" if run.true_poses is not None else ""
    print(f"{plan.folder}: map.geojson, map.png, poses.tum{truth}")
