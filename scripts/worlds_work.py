"""What `grouser worlds` does with its options: make the worlds, draw them, write the sheet."""

from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from grouser.envs.simulation.renderers.registry import installed_renderer
from grouser.envs.simulation.world import World
from grouser.envs.simulation.worlds.registry import make_world, world_descriptions
from grouser.kernels import announce
from grouser.scripts.contact_sheet import describe, sheet, world_cell
from grouser.scripts.terminal import progress
from grouser.scripts.usage import UsageError, usage_errors
from grouser.scripts.worlds import Worlds

_MOST_COLUMNS = 4
_LEVELS = 4  # grey levels that are written as one


class _Variation(NamedTuple):
    """One cell of the sheet."""

    name: str
    difficulty: float
    seed: int


def draw_worlds(options: Worlds) -> int:
    """Draw the sheet, say where it is, and return the exit code."""
    with usage_errors():
        variations = _prepare(options)
    cells = _draw(options, variations)
    _write(options.output, sheet(cells, _columns(options, len(variations))))
    print(f"{options.output}: {len(cells)} worlds")
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
    installed_renderer(options.renderer)  # raises, and says what there is or what is missing
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
    cells = []
    with progress("", len(variations)) as bar:
        for variation in variations:
            bar.describe(variation.name)
            world = _make(options, variation)
            words = f"difficulty {variation.difficulty:g}, seed {variation.seed}; {describe(world)}"
            cells.append(world_cell(world, _title(variation), words, renderer=options.renderer))
            bar.advance()
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
