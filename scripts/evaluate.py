"""`grouser evaluate`: drivers on estimated poses, scored in the loop."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from grouser.scripts.option import option


@dataclass(frozen=True)
class Evaluate:
    """Let a driver reach goals by the poses of several estimators, in the same episodes for each.

    Success is a stop within 0.3 m of the true goal. SPL weighs it by how direct the way was; the
    price of estimation is the SPL under the true pose minus that under the estimator. Intervals
    hold 95 % of bootstrap resamples of the episodes.

    Some to try:

    grouser evaluate --policy pursuit --estimators dead-reckoning ekf-line-slam

    grouser evaluate --policy pursuit straight --world room --goals 3 --episodes 50

    grouser evaluate --policy pursuit --goals 3 --open-loop

    grouser evaluate --pose-latency 0 0.1 0.2 0.4 0.8

    grouser evaluate --policy runs/ppo/policy.zip --output results/ppo --resume
    """

    policy: Annotated[tuple[str, ...], option("NAME ...")] = ("pretrained",)
    """Who drives: pretrained (default), a classical driver (straight, pursuit, dynamic-window), or
    the file of a trained one. Several are scored in the same episodes, for a train-deploy matrix,
    and the others are compared with the first."""
    estimators: Annotated[tuple[str, ...], option("NAME ...")] = (
        "ground-truth",
        "dead-reckoning",
        "icr-ekf",
        "one-point-ransac",
        "ekf-line-slam",
    )
    """Whose poses the driver gets; by default ground-truth, dead-reckoning, icr-ekf,
    one-point-ransac and ekf-line-slam. emulated:NAME draws from the errors of a model of
    `grouser fit-emulator` (a name that comes with Grouser, or a file). ground-truth is run in any
    case, for the price."""
    episodes: Annotated[int, option("N")] = 20
    """Episodes of each, 20 by default."""
    seed: Annotated[int, option("S")] = 0
    """Of the first episode, 0 by default; the next ones follow it."""
    world: Annotated[str, option("NAME")] = "depot"
    """Kind of world: depot by default, where the lidar sees all that a robot can run into."""
    goals: Annotated[int, option("N")] = 1
    """Goals to reach in an episode, one after another; 1 by default."""
    time_limit: Annotated[float, option("S")] = 100.0
    """For each goal, s; 100 by default."""
    pose_latency: Annotated[tuple[float, ...], option("S ...")] = (0.0,)
    """How late estimates arrive, s of simulated time; 0 by default. Several make a sweep, with a
    plot of SPL over latency."""
    difficulty: Annotated[float | None, option("0..1")] = None
    """How hard the world is; 0.5 by default."""
    terrain: Annotated[str | None, option("NAME")] = None
    """One ground everywhere (asphalt, cement, grass, gravel, ice, mud), or mixed."""
    randomize: Annotated[tuple[str, ...], option("NAME ...")] = ()
    """What varies from seed to seed: texture, light, clutter, friction, sensor_noise."""
    dynamics: Annotated[str | None, option("NAME")] = None
    """bullet (default) or fast."""
    effects: Annotated[tuple[str, ...], option("NAME=AMOUNT ...")] = ()
    """What is wrong with sensors all the time, such as stereo.motion_blur=0.01."""
    faults: Annotated[tuple[str, ...], option("NAME:START:END:AMOUNT ...")] = ()
    """What goes wrong for a while [s], such as stereo.darkness:5:8:0.9."""
    open_loop: bool = False
    """Also let each estimator watch the drives made under the true pose, and compare the order of
    their errors there with the order of their SPL (Kendall's tau)."""
    processes: Annotated[int | None, option("N")] = None
    """How many episodes run at once; by default one a processor."""
    ray: Annotated[str | None, option("ADDRESS")] = None
    """Address of a Ray cluster that runs them instead, "auto" or host:port."""
    output: Annotated[Path | None, option("DIR")] = None
    """Folder for the results; by default a new one, results/evaluate-..."""
    no_plots: bool = False
    """Do without the PNG plot of a sweep of latencies."""
    resume: bool = False
    """Complete the results in --output: episodes that are there are not run again."""

    def run(self) -> int:
        """Evaluate, print the table, and return the exit code."""
        from grouser.scripts.evaluate_work import evaluate  # help and misspellings need not wait

        return evaluate(self)
