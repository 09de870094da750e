"""What `grouser compare` does with its options: prepare, compare, report."""

from datetime import datetime
from math import radians
from pathlib import Path
from typing import Any

from rich.console import Console

from grouser import __version__
from grouser.envs.plane.world import PLANE_WORLDS
from grouser.envs.recordings.kitti import DamagedImage
from grouser.estimators import registry
from grouser.estimators.evaluation.plots import plot_results, require_matplotlib
from grouser.estimators.evaluation.results import ResultsFolder
from grouser.estimators.evaluation.table import results_table
from grouser.rig import camera_mount
from grouser.scripts.compare import Compare
from grouser.scripts.compare_estimators import choose, sensors_for
from grouser.scripts.compare_execution import DRIVERS, PLANNED, TOUR, Plan, execute
from grouser.scripts.compare_source import Log, Source, World
from grouser.scripts.compare_world import world_options
from grouser.scripts.plane_source import Plane
from grouser.scripts.terminal import progress, table_console
from grouser.scripts.usage import UsageError, usage_errors

_DEFAULT_WORLD = "yard"
_OWN_DRIVERS = {"yard": "figure-eight"}
"""Of worlds with the room for it; elsewhere a tour is the default."""


def compare(options: Compare) -> int:
    """Compare, print the table, and return the exit code."""
    console = table_console()
    with usage_errors():
        plan = prepare(options)
    try:
        finished = _work(plan)
    except DamagedImage as error:
        raise UsageError(f"{error}; runs that were done are kept, --resume goes on") from error
    finally:
        plan.close()
    _report(plan, console, plots=not options.no_plots)
    return 0 if finished else 130


def prepare(options: Compare) -> Plan:
    """Everything that can be refused is refused here, before any long work."""
    _check_numbers(options)
    if not options.no_plots:
        require_matplotlib()
    source = _source(options)
    driver = _driver(options, source)
    for name in options.estimators:
        registry.spec(name)  # before anything slow is imported for the source
    gives = source.gives()
    names = choose(options.estimators, gives, source.label)
    steps = source.steps(options.steps)
    settings = {"grouser": __version__, **source.settings, "driver": driver, "steps": steps}
    folder = ResultsFolder(_output(options, source), settings, resume=options.resume)
    env = source.make(sensors_for(names, gives))
    scout = source.make(()) if driver in PLANNED else None
    plan = Plan(
        env,
        source.label,
        names,
        driver,
        options.seeds,
        steps,
        folder,
        reference_sigmas=source.reference_sigmas,
        scout=scout,
    )
    for name in names:
        registry.make(name, plan.rig)
    return plan


def _check_numbers(options: Compare) -> None:
    if options.seeds < 1:
        raise UsageError(f"--seeds must be at least 1, got {options.seeds}")
    if options.steps is not None and options.steps < 1:
        raise UsageError(f"--steps must be at least 1, got {options.steps}")
    if options.reference_sigma is not None and not min(options.reference_sigma) > 0:
        given = " ".join(f"{sigma:g}" for sigma in options.reference_sigma)
        raise UsageError(f"--reference-sigma must be two positive numbers, m and deg, got {given}")
    if options.resume and options.output is None:
        raise UsageError("--resume needs --output: the folder of the results to complete")


def _source(options: Compare) -> Source:
    if options.log is not None and options.world is not None:
        raise UsageError("--world and --log exclude each other: give one of them")
    rig, world = _rig_overrides(options), _world_options(options)
    if options.log is not None:
        if world:
            raise UsageError(
                f"--{next(iter(world))} describes a simulated world and excludes --log"
            )
        return Log(options.log, rig, options.odometry_noise or 0.0, options.reference_sigma)
    if options.reference_sigma is not None:
        raise UsageError(
            "--reference-sigma is for the reference poses of a recording and needs --log; a world "
            "knows the truth"
        )
    if options.odometry_noise is not None:
        raise UsageError(
            "--odometry-noise is for the odometry of a recording and needs --log; in a world, give "
            "--effects tracks.noise=AMOUNT"
        )
    if rig:
        raise UsageError(
            "--camera-... and --disparity-offset-px describe the camera of a recording and need "
            "--log; a world knows its own camera"
        )
    if options.world in PLANE_WORLDS:
        return _plane(options, world)
    return World(options.world or _DEFAULT_WORLD, world)


def _plane(options: Compare, world: dict[str, Any]) -> Plane:
    if world:
        raise UsageError(f"--{next(iter(world))} does not go with --world {options.world}, a plane")
    if options.driver not in (None, TOUR):
        raise UsageError(
            f"--driver {options.driver} does not go with --world {options.world}, which has a "
            f"course of its own: leave it out, or give {TOUR}"
        )
    assert options.world is not None
    return Plane(options.world)


def _world_options(options: Compare) -> dict[str, Any]:
    return world_options(
        difficulty=options.difficulty,
        terrain=options.terrain,
        randomize=options.randomize,
        dynamics=options.dynamics,
        renderer=options.renderer,
        effects=options.effects,
        faults=options.faults,
    )


def _rig_overrides(options: Compare) -> dict[str, Any]:
    position = (options.camera_x, options.camera_y, options.camera_z)
    angles = (options.camera_roll_degrees, options.camera_pitch_degrees, options.camera_yaw_degrees)
    overrides: dict[str, Any] = {}
    if any(value is not None for value in (*position, *angles)):
        roll, pitch, yaw = (radians(angle or 0.0) for angle in angles)
        mount = camera_mount(*(value or 0.0 for value in position), roll=roll, pitch=pitch, yaw=yaw)
        overrides["stereo.T_base_camera"] = mount.tolist()
    if options.disparity_offset_px is not None:
        overrides["stereo.disparity_offset"] = options.disparity_offset_px
    return overrides


def _driver(options: Compare, source: Source) -> str | None:
    if not source.drivable:
        if options.driver is not None:
            raise UsageError("--driver has no effect on a recording: leave it out with --log")
        return None
    driver = options.driver or _OWN_DRIVERS.get(options.world or _DEFAULT_WORLD, TOUR)
    if driver not in DRIVERS:
        raise UsageError(f"there is no driver {driver!r}; there are: {', '.join(DRIVERS)}")
    return driver


def _output(options: Compare, source: Source) -> Path:
    if options.output is not None:
        return options.output
    what = source.label.partition(":")[2]
    return Path("results") / f"compare-{what}-{datetime.now():%Y%m%d-%H%M%S}"


def _work(plan: Plan) -> bool:
    """Do the runs under a progress bar; whether it was left to finish."""
    with progress("", plan.total_steps) as bar:
        try:
            execute(plan, on_rollout=bar.describe, on_step=bar.advance)
        except KeyboardInterrupt:
            return False
    return True


def _report(plan: Plan, console: Console, *, plots: bool) -> None:
    summaries = plan.folder.summaries
    if not summaries:
        console.print("interrupted before the first run was done: nothing was kept")
        return
    driver = f", {plan.driver}" if plan.driver else ""
    title = f"{plan.source}{driver}, {plan.steps} steps"
    console.print(results_table(summaries, title, width=console.width))
    drawn = plot_results(plan.folder) if plots else []
    console.print(f"{len(summaries)} runs in {plan.folder.path}: results.json, trajectories (TUM)")
    for path in drawn:
        console.print(f"  {path}")
