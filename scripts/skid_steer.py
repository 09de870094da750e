"""`grouser skid-steer`: does the simulated ground turn a robot as little as the real one did?"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro


@dataclass(frozen=True)
class SkidSteer:
    """Compare how little a real skid-steered robot turned with what the simulator makes of it.

    Reads drives of a Clearpath Husky (run*.csv: X Y theta u1 u2 ..., 0.1 s apart), drives a robot
    of its size and weight in the simulator with the same wheel speeds, on every kind of ground, and
    prints by how much both turn less than their wheels say (yaw efficiency).

    To try:

    grouser skid-steer --data path/to/skid_steer --output results/skid-steer
    """

    data: Annotated[Path, tyro.conf.arg(metavar="DIR")]
    """Folder with the recorded drives, run0.csv and so on."""
    output: Annotated[Path, tyro.conf.arg(metavar="DIR")] = Path("results/skid-steer")
    """Folder for the plot."""
    no_plots: bool = False
    """Do without the PNG plot."""

    def run(self) -> int:
        """Compare, print both tables, draw, and return the exit code."""
        from grouser.scripts.skid_steer_work import compare_with_recordings  # help need not wait

        return compare_with_recordings(self)
