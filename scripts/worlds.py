"""`grouser worlds`: a contact sheet of simulated worlds."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from grouser.scripts.option import option


def _arg(metavar: str) -> Any:
    return tyro.conf.arg(metavar=metavar)


@dataclass(frozen=True)
class Worlds:
    """Draw a contact sheet of the simulated worlds: from above, and from the robot's camera.

    From above, the orange arrow is the start with the place around it that is kept clear, purple
    dots are goals that the robot can reach, and what hangs above the robot is transparent.

    Some to try:

    grouser worlds

    grouser worlds --names forest rubble --difficulty 0 0.5 1

    grouser worlds --names corridor --seeds 4 --output corridors.png

    grouser worlds --names yard --terrain mixed --randomize light texture --seeds 3
    """

    names: Annotated[tuple[str, ...], option("NAME ...")] = ()
    """Worlds to draw, all by default: yard, depot, room, corridor, parking-lot, garden, orchard,
    forest, rubble."""
    difficulty: Annotated[tuple[float, ...], _arg("D ...")] = (0.5,)
    """How hard, from 0 to 1; several are drawn side by side."""
    seeds: Annotated[int, _arg("N")] = 1
    """Worlds of each kind and difficulty: seeds 0 to N-1."""
    terrain: Annotated[str | None, option("NAME")] = None
    """Another ground: gravel, asphalt, cement, grass, mud, ice, or mixed patches of all."""
    randomize: Annotated[tuple[str, ...], option("WHAT ...")] = ()
    """What to vary at random: texture, light, clutter, friction (not visible)."""
    renderer: Annotated[str, _arg("NAME")] = "raster"
    """What draws the camera's view: raster or opengl."""
    output: Annotated[Path, _arg("FILE")] = Path("worlds.png")
    """The PNG file to write."""

    def run(self) -> int:
        """Draw the sheet, say where it is, and return the exit code."""
        from grouser.scripts.worlds_work import draw_worlds  # help and misspellings need not wait

        return draw_worlds(self)
