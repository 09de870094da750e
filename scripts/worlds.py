"""`grouser worlds`: a contact sheet of simulated worlds."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import cv2
import numpy as np
import tyro
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from grouser.envs.simulation.renderers.registry import RENDERERS
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world, world_descriptions
from grouser.kernels import announce
from grouser.scripts.contact_sheet import describe, sheet, world_cell
from grouser.scripts.usage import UsageError, usage_errors

_MOST_COLUMNS = 4
_LEVELS = 4  # grey levels that are written as one


def _arg(metavar: str) -> Any:
    return tyro.conf.arg(metavar=metavar)


def _silent(metavar: str) -> Any:
    """The help text says what happens without the option; tyro's "(default: None)" would not."""
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="")


class _Variation(NamedTuple):
    """One cell of the sheet."""

    name: str
    difficulty: float
    seed: int


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

    names: Annotated[tuple[str, ...], _silent("NAME ...")] = ()
    """Worlds to draw, all by default: yard, room, corridor, parking-lot, garden, orchard, forest,
    rubble."""
    difficulty: Annotated[tuple[float, ...], _arg("D ...")] = (0.5,)
    """How hard, from 0 to 1; several are drawn side by side."""
    seeds: Annotated[int, _arg("N")] = 1
    """Worlds of each kind and difficulty: seeds 0 to N-1."""
    terrain: Annotated[str | None, _silent("NAME")] = None
    """Another ground: gravel, asphalt, cement, grass, mud, ice, or mixed patches of all."""
    randomize: Annotated[tuple[str, ...], _silent("WHAT ...")] = ()
    """What to vary at random: texture, light, clutter, friction (not visible)."""
    renderer: Annotated[str, _arg("NAME")] = "raster"
    """What draws the camera's view: raster or opengl."""
    output: Annotated[Path, _arg("FILE")] = Path("worlds.png")
    """The PNG file to write."""

    def run(self) -> int:
        """Draw the sheet, say where it is, and return the exit code."""
        with usage_errors():
            variations = _prepare(self)
        cells = _draw(self, variations)
        _write(self.output, sheet(cells, _columns(self, len(variations))))
        print(f"{self.output}: {len(cells)} worlds")
        return 0


def _prepare(options: Worlds) -> list[_Variation]:
    """Everything that can be refused is refused here, before any long work."""
    if options.seeds < 1:
        raise UsageError(f"--seeds must be at least 1, got {options.seeds}")
    if not options.difficulty:
        raise UsageError("--difficulty needs at least one number from 0 to 1")
    if options.output.suffix.lower() != ".png":
        raise UsageError(f"--output must be a .png file, got {options.output}")
    if not options.output.resolve().parent.is_dir():
        raise UsageError(f"--output: there is no folder {options.output.resolve().parent}")
    if options.renderer not in RENDERERS:
        raise UsageError(
            f"there is no renderer {options.renderer!r}; there are: {', '.join(RENDERERS)}"
        )
    names = options.names or tuple(world_descriptions())
    variations = [
        _Variation(name, difficulty, seed)
        for name in names
        for difficulty in options.difficulty
        for seed in range(options.seeds)
    ]
    for variation in variations[:: options.seeds]:
        _make(options, variation)  # raises, and says what there is
    return variations


def _make(options: Worlds, variation: _Variation) -> World:
    return make_world(
        variation.name,
        np.random.default_rng(variation.seed),
        difficulty=variation.difficulty,
        terrain=options.terrain,
        randomize=options.randomize,
    )


def _draw(options: Worlds, variations: list[_Variation]) -> list[NDArray[np.uint8]]:
    """The cells of the sheet, under a progress bar."""
    announce()
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    )
    cells = []
    with bar:
        task = bar.add_task("", total=len(variations))
        for variation in variations:
            bar.update(task, description=variation.name)
            world = _make(options, variation)
            words = f"difficulty {variation.difficulty:g}, seed {variation.seed}; {describe(world)}"
            cells.append(world_cell(world, _title(variation), words, renderer=options.renderer))
            bar.advance(task)
    return cells


def _title(variation: _Variation) -> str:
    return f"{variation.name}: {world_descriptions()[variation.name]}"


def _columns(options: Worlds, n: int) -> int:
    """The variations of a world side by side, or two worlds."""
    each = len(options.difficulty) * options.seeds
    return each if 1 < each <= _MOST_COLUMNS else min(n, 2)


def _write(path: Path, image: NDArray[np.uint8]) -> None:
    """As PNG; in fewer grey levels than can be told apart, which take two thirds of the bytes."""
    coarse = np.minimum(image.astype(np.uint16) + _LEVELS // 2, 255) // _LEVELS * _LEVELS
    options = [cv2.IMWRITE_PNG_COMPRESSION, 9]
    done, data = cv2.imencode(".png", coarse[..., ::-1].astype(np.uint8), options)
    assert done
    path.write_bytes(data.tobytes())
