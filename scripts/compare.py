"""`grouser compare`: pose estimators side by side, in a simulated world or on a recording."""

from dataclasses import dataclass
from datetime import datetime
from math import radians
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from grouser import __version__
from grouser.envs.recordings.kitti import DamagedImage
from grouser.estimators import registry
from grouser.estimators.evaluation.plots import plot_results, require_matplotlib
from grouser.estimators.evaluation.results import ResultsFolder
from grouser.estimators.evaluation.table import results_table
from grouser.rig import camera_mount
from grouser.scripts.compare_estimators import choose, sensors_for
from grouser.scripts.compare_execution import DRIVERS, PLANNED, TOUR, Plan, execute
from grouser.scripts.compare_source import Log, Source, World
from grouser.scripts.compare_world import world_options
from grouser.scripts.usage import UsageError, usage_errors

_DEFAULT_WORLD = "yard"
_OWN_DRIVERS = {"yard": "figure-eight"}
"""Of worlds with the room for it; elsewhere a tour is the default."""
_PLAIN_WIDTH = 100


def _arg(metavar: str) -> Any:
    """The help texts say what happens without an option; tyro's "(default: None)" would not."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


@dataclass(frozen=True)
class Compare:
    """Compare pose estimators on the same observations: figures, trajectories and plots.

    In a world, the robot drives a scripted course that all estimators watch, so that they see the
    same bits; with --driver waypoints each drives on its own estimate. With --log, a recording is
    replayed.

    Some to try:

    grouser compare --seeds 2

    grouser compare --world yard --driver spot-turn --estimators dead-reckoning one-point-ransac

    grouser compare --driver waypoints --steps 400

    grouser compare --world orchard --difficulty 0.8 --faults stereo.darkness:20:25:0.95

    grouser compare --log path/to/kitti/sequence --camera-z 1.65 --no-plots

    grouser compare --seeds 10 --output results/ten --resume
    """

    world: Annotated[str | None, _arg("NAME")] = None
    """Simulated world to drive in (yard when no --log is given)."""
    log: Annotated[Path | None, _arg("DIR")] = None
    """Recording to replay instead: a KITTI-odometry-style folder of stereo images."""
    estimators: Annotated[tuple[str, ...], _arg("NAME ...")] = ()
    """Estimators to compare; by default ground-truth, dead-reckoning, one-point-ransac and
    five-point-ransac, as far as the source can feed them."""
    seeds: Annotated[int, _arg("N")] = 1
    """Runs of each, one by default: seeds 0 to N-1, of the world and of random choices."""
    steps: Annotated[int | None, _arg("N")] = None
    """Steps a run: 600 (a minute) in a world, all of a recording by default."""
    driver: Annotated[str | None, _arg("NAME")] = None
    """Course in a world: straight, spot-turn, figure-eight (default in the yard), tour (through
    the world's goals; default elsewhere), or waypoints (driven on the estimate)."""
    difficulty: Annotated[float | None, _arg("0..1")] = None
    """World: how hard; 0.5 by default."""
    terrain: Annotated[str | None, _arg("NAME")] = None
    """World: one ground everywhere (asphalt, cement, grass, gravel, ice, mud), or mixed."""
    randomize: Annotated[tuple[str, ...], _arg("NAME ...")] = ()
    """World: what varies from seed to seed: texture, light, clutter, friction, sensor_noise."""
    dynamics: Annotated[str | None, _arg("NAME")] = None
    """World: bullet (default) or fast."""
    renderer: Annotated[str | None, _arg("NAME")] = None
    """World: raster (default) or opengl."""
    effects: Annotated[tuple[str, ...], _arg("NAME=AMOUNT ...")] = ()
    """World: what is wrong with sensors all the time, such as stereo.motion_blur=0.01."""
    faults: Annotated[tuple[str, ...], _arg("NAME:START:END:AMOUNT ...")] = ()
    """World: what goes wrong for a while [s], such as stereo.darkness:5:8:0.9."""
    output: Annotated[Path | None, _arg("DIR")] = None
    """Folder for the results; by default a new one, results/compare-..."""
    resume: bool = False
    """Complete the results in --output: runs that are there are not done again."""
    no_plots: bool = False
    """Do without the PNG plots of the top view and the error over distance."""
    camera_x: Annotated[float | None, _arg("M")] = None
    """Recording: how far the left camera is ahead of the robot's centre."""
    camera_y: Annotated[float | None, _arg("M")] = None
    """Recording: how far it is to the left of it."""
    camera_z: Annotated[float | None, _arg("M")] = None
    """Recording: how far it is above it."""
    camera_roll_degrees: Annotated[float | None, _arg("DEG")] = None
    """Recording: its roll, the right side down."""
    camera_pitch_degrees: Annotated[float | None, _arg("DEG")] = None
    """Recording: its pitch, looking down."""
    camera_yaw_degrees: Annotated[float | None, _arg("DEG")] = None
    """Recording: its yaw, looking to the left."""
    disparity_offset_px: Annotated[float | None, _arg("PX")] = None
    """Recording: measured minus true disparity, where its rectification is not perfect."""

    def run(self) -> int:
        """Compare, print the table, and return the exit code."""
        console = _console()
        with usage_errors():
            plan = _prepare(self)
        try:
            finished = _work(plan)
        except DamagedImage as error:
            raise UsageError(f"{error}; runs that were done are kept, --resume goes on") from error
        finally:
            plan.close()
        _report(plan, console, plots=not self.no_plots)
        return 0 if finished else 130


def _prepare(options: Compare) -> Plan:
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
    plan = Plan(env, source.label, names, driver, options.seeds, steps, folder, scout)
    for name in names:
        registry.make(name, plan.rig)
    return plan


def _check_numbers(options: Compare) -> None:
    if options.seeds < 1:
        raise UsageError(f"--seeds must be at least 1, got {options.seeds}")
    if options.steps is not None and options.steps < 1:
        raise UsageError(f"--steps must be at least 1, got {options.steps}")
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
        return Log(options.log, rig)
    if rig:
        raise UsageError(
            "--camera-... and --disparity-offset-px describe the camera of a recording and need "
            "--log; a world knows its own camera"
        )
    return World(options.world or _DEFAULT_WORLD, world)


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
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    )
    with bar:
        task = bar.add_task("", total=plan.total_steps)
        try:
            execute(
                plan,
                on_rollout=lambda words: bar.update(task, description=words),
                on_step=lambda: bar.advance(task),
            )
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


def _console() -> Console:
    """Written to a file or a pipe, the table gets the room that it needs."""
    console = Console()
    return console if console.is_terminal else Console(width=_PLAIN_WIDTH)
