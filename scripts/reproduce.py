"""`grouser reproduce`: a paper's tables and figures again, with our numbers beside its own."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from grouser.scripts.option import option


@dataclass(frozen=True)
class Reproduce:
    """Do a paper's experiments in simulation, and write a page with its numbers beside ours.

    The folder holds page.html (one file, pictures included), results.json (every number of the
    page by name) and the experiments, each as soon as it is done: what was interrupted goes on
    with --resume, and where nothing is missing, that draws the page anew.

    Some to try:

    grouser reproduce zhao --quick

    grouser reproduce yan --output results/yan

    grouser reproduce zhao --output results/zhao --resume

    grouser reproduce zhao --estimators one-point-ransac dead-reckoning --output results/two
    """

    paper: tyro.conf.Positional[Literal["zhao", "yan"]]
    """Which paper: zhao, one-point RANSAC visual odometry for a crawler robot (up to an hour);
    yan, EKF SLAM with lines that are seen by bisection (a quarter of an hour)."""
    quick: bool = False
    """Little of everything, to see that it works; the numbers then mean little."""
    estimators: Annotated[tuple[str, ...], option("NAME ...")] = ()
    """Of zhao: estimators that take part; by default all that are registered and read neither
    lidar nor lines."""
    jobs: Annotated[int, option("N")] = 2
    """Processes at once, 2 by default; what measures time runs before, alone."""
    output: Annotated[Path | None, option("DIR")] = None
    """Folder for the page; by default a new one, results/reproduce-..."""
    resume: bool = False
    """Go on with the folder --output: what is done is not done again."""

    def run(self) -> int:
        """Do what is missing, write the page, say where it is, and return the exit code."""
        from grouser.scripts.reproduce_work import reproduce  # help and misspellings need not wait

        return reproduce(self)
