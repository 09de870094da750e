"""`grouser watch`: see a driver drive on an estimated pose."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from grouser.scripts.option import option


@dataclass(frozen=True)
class Watch:
    """Show an episode: the robot from behind, in a window or in a file.

    Files show the world from above besides: what blocks the robot, its goal (a ring), where it
    truly went (green) and where it believed to be (orange).

    Some to try:

    grouser watch --policy pursuit --estimator dead-reckoning --goals 3 --output drive.mp4

    grouser watch --policy dynamic-window --estimator ekf-line-slam --output drive.png

    grouser watch --policy runs/ppo/policy.zip
    """

    policy: Annotated[str, option("NAME")] = "pretrained"
    """Who drives: pretrained (default), straight, pursuit, dynamic-window, or a policy's file."""
    estimator: Annotated[str, option("NAME")] = "ekf-line-slam"
    """Whose poses the driver gets; ekf-line-slam by default."""
    world: Annotated[str, option("NAME")] = "depot"
    """Kind of world; the depot by default."""
    goals: Annotated[int, option("N")] = 1
    """Goals to reach, one after another; 1 by default."""
    seed: Annotated[int, option("S")] = 0
    """Of the episode, 0 by default."""
    pose_latency: Annotated[float, option("S")] = 0.0
    """How late estimates arrive, s; 0 by default."""
    dynamics: Annotated[str | None, option("NAME")] = None
    """bullet (default) or fast."""
    output: Annotated[Path | None, option("FILE")] = None
    """A video (.mp4, .avi) of all of it, or a picture (.png) of its end; a window when left out,
    which needs a screen and the extra `view`."""

    def run(self) -> int:
        """Drive, show, tell how it ended, and return the exit code."""
        from grouser.scripts.watch_work import watch  # help and misspellings need not wait

        return watch(self)
