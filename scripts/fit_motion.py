"""`grouser fit-motion`: is the slip of the light motion model that of the physics?"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from grouser.scripts.option import option


@dataclass(frozen=True)
class FitMotion:
    """Drive Bullet's robot and the light model alike, and compare how they slip.

    Both follow the same law of the ground; what may differ is the body between its forces. Commands
    of all speeds and turns, level and on a slope, give distributions of slip, whose quantiles and
    Kolmogorov-Smirnov distance are printed. And the ground's numbers are fitted to Bullet's
    motion, from wrong ones: where the light model is as good as the physics, they come out as
    they are for both.

    To try:

    grouser fit-motion --output results/motion
    """

    terrains: Annotated[tuple[str, ...] | None, option("NAME ...")] = None
    """Grounds to drive on; all by default."""
    output: Annotated[Path, option("DIR")] = Path("results/motion")
    """Folder for agreement.json and motion.png."""
    no_plots: bool = False
    """Do without the PNG plot."""

    def run(self) -> int:
        """Drive, compare, fit, print both tables, draw, and return the exit code."""
        from grouser.scripts.fit_motion_work import fit_motion  # help need not wait

        return fit_motion(self)
