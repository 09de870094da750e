"""`grouser montecarlo`: how accurate and how honest visual odometry is where all is known."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True)
class MonteCarlo:
    """Run visual odometry in a synthetic world of points, without images, and score it.

    The world is that of the prototypes: 320 x 240 px, f 260 px, baseline 0.12 m, 0.3 px of noise in
    either eye, 30 % of the matches wrong by up to 20 px, tracks with errors of scale and white
    noise, 12 mm a frame. The table has the errors of position and heading at the end, that of the
    position over the drive (rms), and the NEES of the pose: 3 where it is honest, more where it
    promises too much. Every method sees the same drives, with its own defaults.

    Some to try:

    grouser montecarlo

    grouser montecarlo --scenarios sideslip blackout --methods dead-reckoning one-point --seeds 20

    grouser montecarlo --outliers 0.6 --output scores.json
    """

    scenarios: tuple[str, ...] = ()
    """Drives by name; all of them when left out. A wrong name lists those that there are."""
    methods: tuple[str, ...] = ()
    """Methods by name; all of them when left out."""
    seeds: int = 5
    """Drives of every scenario."""
    noise_px: float = 0.3
    """Of u and v in the left eye and of u in the right one; the estimators are told."""
    outliers: float = 0.3
    """Share of the matches that are wrong."""
    processes: int = 2
    """How many drives run at once."""
    ray: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Address of a Ray cluster that runs the drives instead, "auto" or host:port."""
    output: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """JSON file for the score of every run and their means."""

    def run(self) -> int:
        """Run, print, write, and return the exit code."""
        from grouser.scripts.montecarlo_work import run_and_report  # help need not wait

        return run_and_report(self)
